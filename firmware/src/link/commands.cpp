// Dispatch by message, range checks of setpoints, the COMMAND_LONG table and the parameter service.
#include "commands.h"

#include "mavlink.h"

namespace shoal {
namespace {

constexpr uint8_t kCompanion = MAV_COMP_ID_ONBOARD_COMPUTER;
constexpr float kFastest = 2.0f;           // m/s, of a setpoint
constexpr float kAcrossTolerance = 0.05f;  // m/s: velocity and yaw of a setpoint must agree
constexpr uint16_t kRebootDelay = 200;     // ms, for the acknowledgement to leave

}  // namespace

bool Commands::addressed(uint8_t system, uint8_t component) const {
  return (system == 0 || system == parts_.system()) && (component == 0 || component == MAV_COMP_ID_AUTOPILOT1);
}

void Commands::handle(const Frame& frame) {
  switch (frame.id) {
    case MAVLINK_MSG_ID_HEARTBEAT:
      if (frame.component == kCompanion) parts_.companion.heartbeat_age_ms = 0;
      break;
    case MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED:
      on_setpoint(frame);
      break;
    case MAVLINK_MSG_ID_AUTOPILOT_VERSION:
      on_version(frame);
      break;
    case MAVLINK_MSG_ID_COMMAND_LONG:
      on_command(frame);
      break;
    case MAVLINK_MSG_ID_PARAM_SET:
      on_parameter_set(frame);
      break;
    case MAVLINK_MSG_ID_PARAM_REQUEST_READ:
      on_parameter_read(frame);
      break;
    case MAVLINK_MSG_ID_PARAM_REQUEST_LIST: {
      const mavlink_param_request_list_t m = frame.as<mavlink_param_request_list_t>();
      if (addressed(m.target_system, m.target_component)) list_next_ = 0;
      break;
    }
    case MAVLINK_MSG_ID_TIMESYNC:
      on_timesync(frame);
      break;
    default:
      break;
  }
}

bool Commands::step() {
  if (list_next_ >= kParameterCount) return false;
  if (send_parameter(list_next_)) ++list_next_;
  return true;
}

// Heading, depth and speed come in one message; a bad one changes nothing, is counted, and ages like silence.
void Commands::on_setpoint(const Frame& frame) {
  const auto m = frame.as<mavlink_set_position_target_local_ned_t>();
  if (frame.component != kCompanion || !addressed(m.target_system, m.target_component)) return;
  bool good = m.coordinate_frame == MAV_FRAME_LOCAL_NED && m.type_mask == kSetpointMask && isfinite(m.z) &&
              isfinite(m.vx) && isfinite(m.vy) && isfinite(m.yaw) && fabsf(m.yaw) <= 2.0f * kPi && m.z >= 0.0f &&
              m.z <= parts_.parameters.get(Parameter::DEPTH_MAX) && fabsf(m.vx) <= kFastest && fabsf(m.vy) <= kFastest;
  float speed = 0.0f;
  if (good) {
    speed = sqrtf(m.vx * m.vx + m.vy * m.vy);
    const float off = fabsf(wrap_pi(atan2f(m.vy, m.vx) - m.yaw));
    const bool astern = off > 0.5f * kPi;
    good = speed <= kFastest && speed * (astern ? kPi - off : off) <= kAcrossTolerance;
    if (astern) speed = -speed;
  }
  if (!good) {
    ++parts_.companion.setpoints_refused;
    notices_.setpoint_refused();
    return;
  }
  parts_.companion.setpoint = {wrap_pi(m.yaw), m.z, speed};
  parts_.companion.north_mps = m.vx;
  parts_.companion.east_mps = m.vy;
  parts_.companion.setpoint_age_ms = 0;
}

void Commands::on_version(const Frame& frame) {
  if (frame.component != kCompanion) return;
  const auto m = frame.as<mavlink_autopilot_version_t>();
  const uint8_t ours[] = SHOAL_DIALECT_HASH;
  memcpy(their_hash_, m.middleware_custom_version, sizeof their_hash_);
  dialect_ = memcmp(ours, their_hash_, sizeof ours) == 0 ? Dialect::equal : Dialect::different;
  if (dialect_ == Dialect::different) notices_.dialect_refused(their_hash_);
}

void Commands::on_timesync(const Frame& frame) {
  auto m = frame.as<mavlink_timesync_t>();
  if (m.tc1 != 0) return;
  m.tc1 = static_cast<int64_t>(parts_.now_us) * 1000;
  SHOAL_SEND(writer_, parts_.system(), TIMESYNC, m);
}

void Commands::on_command(const Frame& frame) {
  const auto m = frame.as<mavlink_command_long_t>();
  if (!addressed(m.target_system, m.target_component)) return;
  mavlink_command_ack_t ack = {};
  ack.command = m.command;
  ack.result = execute(m.command, m.param1, m.param2, frame);
  ack.target_system = frame.system;
  ack.target_component = frame.component;
  SHOAL_SEND(writer_, parts_.system(), COMMAND_ACK, ack);
}

uint8_t Commands::execute(uint16_t command, float p1, float p2, const Frame& frame) {
  if (!isfinite(p1)) return MAV_RESULT_DENIED;
  const bool p1_is_id = p1 >= 0.0f && p1 < 16777216.0f;
  const uint32_t id = p1_is_id ? static_cast<uint32_t>(p1) : 0xFFFFFFFF;
  switch (command) {
    case MAV_CMD_COMPONENT_ARM_DISARM:
      if (p1 == 1.0f) return arm(frame);
      if (p1 != 0.0f) return MAV_RESULT_DENIED;
      parts_.safety.disarm();
      return MAV_RESULT_ACCEPTED;
    case MAV_CMD_RUN_PREARM_CHECKS:
      if (parts_.safety.driving()) return MAV_RESULT_TEMPORARILY_REJECTED;
      notices_.arming_refused(parts_.safety.refusals());
      return MAV_RESULT_ACCEPTED;
    case MAV_CMD_DO_FLIGHTTERMINATION:
      if (p1 < 0.5f) return MAV_RESULT_DENIED;
      parts_.safety.terminate();
      notices_.terminated();
      return MAV_RESULT_ACCEPTED;
    case MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
      if (p1 != 1.0f) return MAV_RESULT_DENIED;
      if (parts_.safety.driving()) return MAV_RESULT_TEMPORARILY_REJECTED;
      parts_.reboot_in_ms = kRebootDelay;
      return MAV_RESULT_ACCEPTED;
    case MAV_CMD_PREFLIGHT_STORAGE:
      return store(p1);
    case MAV_CMD_SET_MESSAGE_INTERVAL:
      return telemetry_.set_interval(id, p2) ? MAV_RESULT_ACCEPTED : MAV_RESULT_DENIED;
    case MAV_CMD_GET_MESSAGE_INTERVAL: {
      mavlink_message_interval_t m = {};
      m.message_id = static_cast<uint16_t>(id);
      m.interval_us = telemetry_.interval_us(id);
      SHOAL_SEND(writer_, parts_.system(), MESSAGE_INTERVAL, m);
      return Telemetry::knows(id) ? MAV_RESULT_ACCEPTED : MAV_RESULT_DENIED;
    }
    case MAV_CMD_REQUEST_MESSAGE:
      return telemetry_.request(id) ? MAV_RESULT_ACCEPTED : MAV_RESULT_DENIED;
    default:
      return MAV_RESULT_UNSUPPORTED;
  }
}

// A companion arms only when its dialect is known to be this one.
uint8_t Commands::arm(const Frame& frame) {
  const CauseSet refusals = parts_.safety.refusals();
  const bool strange = frame.component == kCompanion && dialect_ != Dialect::equal;
  if (strange && dialect_ == Dialect::different) notices_.dialect_refused(their_hash_);
  if (strange && dialect_ == Dialect::unknown) notices_.dialect_unknown();
  if (refusals != 0) notices_.arming_refused(refusals);
  const bool was_driving = parts_.safety.mode() == Mode::armed;
  if (strange || !parts_.safety.arm()) return MAV_RESULT_TEMPORARILY_REJECTED;
  if (!was_driving) parts_.autopilot.reset();
  return MAV_RESULT_ACCEPTED;
}

uint8_t Commands::store(float action) {
  if (parts_.safety.driving()) return MAV_RESULT_TEMPORARILY_REJECTED;
  if (action == 0.0f) return parts_.parameters.load(parts_.board) ? MAV_RESULT_ACCEPTED : MAV_RESULT_FAILED;
  if (action == 1.0f) {
    parts_.parameters.store();
    return MAV_RESULT_ACCEPTED;
  }
  if (action == 2.0f) {
    parts_.parameters.reset_to_defaults();
    return MAV_RESULT_ACCEPTED;
  }
  return MAV_RESULT_DENIED;
}

bool Commands::send_parameter(uint8_t index) {
  mavlink_param_value_t m = {};
  m.param_value = parts_.parameters.at(index);
  m.param_count = kParameterCount;
  m.param_index = index;
  m.param_type = MAV_PARAM_TYPE_REAL32;
  Parameters::copy_name(index, m.param_id);
  return SHOAL_SEND(writer_, parts_.system(), PARAM_VALUE, m);
}

void Commands::on_parameter_set(const Frame& frame) {
  const auto m = frame.as<mavlink_param_set_t>();
  if (!addressed(m.target_system, m.target_component)) return;
  const uint8_t index = Parameters::find(m.param_id);
  if (index == kParameterCount) return;
  const bool locked = parts_.safety.driving() && index == static_cast<uint8_t>(Parameter::SYS_ID);
  if (m.param_type != MAV_PARAM_TYPE_REAL32 || locked ||
      parts_.parameters.set(index, m.param_value) != SetResult::accepted) {
    notices_.parameter_refused(index);
  }
  send_parameter(index);
}

void Commands::on_parameter_read(const Frame& frame) {
  const auto m = frame.as<mavlink_param_request_read_t>();
  if (!addressed(m.target_system, m.target_component)) return;
  const int16_t index = m.param_index >= 0 ? m.param_index : Parameters::find(m.param_id);
  if (index < kParameterCount) send_parameter(static_cast<uint8_t>(index));
}

}  // namespace shoal
