// The table of streams, its scheduler, and one short sender a message.
#include "telemetry.h"

#include "../flash.h"
#include "mavlink.h"

namespace shoal {
namespace {

constexpr float kToDegrees = 1.0f / kDegree;
constexpr float kUsPerTick = 10000.0f;

struct Stream {
  uint16_t id;
  uint8_t interval;  // ticks of 10 ms
  uint8_t phase;     // ticks until the first one
  bool (Telemetry::*send)();
};

const Stream kStreams[kStreamCount] PROGMEM = {
    {MAVLINK_MSG_ID_HEARTBEAT, 100, 1, &Telemetry::heartbeat},
    {MAVLINK_MSG_ID_ATTITUDE, 4, 0, &Telemetry::attitude},
    {MAVLINK_MSG_ID_SCALED_IMU2, 4, 2, &Telemetry::imu},
    {MAVLINK_MSG_ID_SCALED_PRESSURE2, 10, 1, &Telemetry::pressure},
    {MAVLINK_MSG_ID_VFR_HUD, 20, 3, &Telemetry::hud},
    {MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED, 20, 7, &Telemetry::position_target},
    {MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT, 20, 13, &Telemetry::controller},
    {MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 10, 5, &Telemetry::servos},
    {MAVLINK_MSG_ID_SYS_STATUS, 50, 9, &Telemetry::system_status},
    {MAVLINK_MSG_ID_BATTERY_STATUS, 100, 29, &Telemetry::battery},
    {MAVLINK_MSG_ID_MEMINFO, 100, 49, &Telemetry::memory},
    {MAVLINK_MSG_ID_NAMED_VALUE_FLOAT, 20, 17, &Telemetry::named_value},
    {MAVLINK_MSG_ID_TIMESYNC, 50, 19, &Telemetry::timesync},
    {MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0, 0, &Telemetry::version},
};

int16_t to_int16(float value) { return static_cast<int16_t>(clamp(value, -32767.0f, 32767.0f)); }
uint16_t to_uint16(float value) { return static_cast<uint16_t>(clamp(value, 0.0f, 65534.0f)); }

}  // namespace

#define WRITE(NAME, message) \
  write(MAVLINK_MSG_ID_##NAME, message, MAVLINK_MSG_ID_##NAME##_LEN, MAVLINK_MSG_ID_##NAME##_CRC)

Telemetry::Telemetry(const Parts& parts, FrameWriter& writer, const FrameReader& reader)
    : parts_(parts), writer_(writer), reader_(reader) {
  for (uint8_t i = 0; i < kStreamCount; ++i) {
    const Stream stream = read_flash(kStreams[i]);
    interval_[i] = stream.interval;
    wait_[i] = stream.phase;
  }
}

void Telemetry::step(uint8_t at_most) {
  for (uint16_t& wait : wait_) wait -= wait > 0;
  if (++first_ >= kStreamCount) first_ = 0;
  uint8_t i = first_;
  for (uint8_t n = 0; n < kStreamCount && at_most > 0; ++n, ++i) {
    if (i >= kStreamCount) i = 0;
    const bool requested = requested_ != 0 && (requested_ >> i & 1U) != 0;
    if (!requested && (interval_[i] == 0 || wait_[i] > 0)) continue;
    if (!(this->*read_flash(kStreams[i].send))()) return;
    if (requested) {
      requested_ &= static_cast<uint16_t>(~(1U << i));
    } else {
      wait_[i] = interval_[i];
    }
    --at_most;
  }
}

uint8_t Telemetry::index_of(uint32_t id) {
  uint8_t i = 0;
  while (i < kStreamCount && read_flash(kStreams[i].id) != id) ++i;
  return i;
}

bool Telemetry::knows(uint32_t id) { return index_of(id) < kStreamCount; }

bool Telemetry::request(uint32_t id) {
  const uint8_t i = index_of(id);
  if (i == kStreamCount) return false;
  requested_ |= static_cast<uint16_t>(1U << i);
  return true;
}

bool Telemetry::set_interval(uint32_t id, float interval_us) {
  const uint8_t i = index_of(id);
  if (i == kStreamCount || !isfinite(interval_us)) return false;
  if (interval_us < 0.0f) {
    interval_[i] = 0;
  } else if (interval_us == 0.0f) {
    interval_[i] = read_flash(kStreams[i].interval);
  } else {
    interval_[i] = to_uint16(clamp(interval_us / kUsPerTick + 0.5f, 1.0f, 6000.0f));
  }
  wait_[i] = interval_[i];
  return true;
}

int32_t Telemetry::interval_us(uint32_t id) const {
  const uint8_t i = index_of(id);
  if (i == kStreamCount) return 0;
  return interval_[i] == 0 ? -1 : interval_[i] * static_cast<int32_t>(kUsPerTick);
}

bool Telemetry::heartbeat() {
  mavlink_heartbeat_t m = {};
  m.type = MAV_TYPE_SUBMARINE;
  m.autopilot = MAV_AUTOPILOT_GENERIC;
  m.mavlink_version = 3;
  m.custom_mode = static_cast<uint8_t>(parts_.safety.mode());
  m.base_mode = MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | MAV_MODE_FLAG_GUIDED_ENABLED | MAV_MODE_FLAG_STABILIZE_ENABLED;
  if (parts_.safety.driving()) m.base_mode |= MAV_MODE_FLAG_SAFETY_ARMED;
  switch (parts_.safety.mode()) {
    case Mode::disarmed:
      m.system_status = MAV_STATE_STANDBY;
      break;
    case Mode::armed:
      m.system_status = MAV_STATE_ACTIVE;
      break;
    case Mode::failsafe:
      m.system_status = MAV_STATE_CRITICAL;
      break;
    case Mode::terminated:
      m.system_status = MAV_STATE_FLIGHT_TERMINATION;
      break;
  }
  return WRITE(HEARTBEAT, m);
}

bool Telemetry::attitude() {
  const AttitudeEstimator& a = parts_.attitude;
  const Vec3& r = a.rate();
  mavlink_attitude_t m = {parts_.now_ms, a.roll(), a.pitch(), a.yaw(), r.x, r.y, r.z};
  return WRITE(ATTITUDE, m);
}

bool Telemetry::imu() {
  const ImuSample& s = parts_.imu.sample();
  mavlink_scaled_imu2_t m = {};
  m.time_boot_ms = parts_.now_ms;
  const Vec3 mg = s.specific_force * (1000.0f / kGravity);
  const Vec3 mrad = s.rate * 1000.0f;
  const Vec3 mgauss = s.field * 10.0f;
  m.xacc = to_int16(mg.x);
  m.yacc = to_int16(mg.y);
  m.zacc = to_int16(mg.z);
  m.xgyro = to_int16(mrad.x);
  m.ygyro = to_int16(mrad.y);
  m.zgyro = to_int16(mrad.z);
  m.xmag = to_int16(mgauss.x);
  m.ymag = to_int16(mgauss.y);
  m.zmag = to_int16(mgauss.z);
  m.temperature = to_int16(s.temperature_c * 100.0f);
  return WRITE(SCALED_IMU2, m);
}

bool Telemetry::pressure() {
  mavlink_scaled_pressure2_t m = {};
  m.time_boot_ms = parts_.now_ms;
  m.press_abs = parts_.depth_sensor.pressure_pa() * 0.01f;
  m.press_diff = (parts_.depth_sensor.pressure_pa() - parts_.parameters.get(Parameter::SURF_PA)) * 0.01f;
  m.temperature = to_int16(parts_.depth_sensor.temperature_c() * 100.0f);
  return WRITE(SCALED_PRESSURE2, m);
}

bool Telemetry::hud() {
  const float heading = parts_.attitude.yaw() * kToDegrees;
  mavlink_vfr_hud_t m = {};
  m.airspeed = parts_.speed.speed();
  m.groundspeed = parts_.speed.speed();
  m.alt = -parts_.depth.depth();
  m.climb = -parts_.depth.descent();
  m.heading = to_int16(heading < 0.0f ? heading + 360.0f : heading);
  m.throttle = to_uint16(fabsf(parts_.actuators.outputs().throttle) * 100.0f);
  return WRITE(VFR_HUD, m);
}

bool Telemetry::position_target() {
  const Setpoint& s = parts_.companion.setpoint;
  mavlink_position_target_local_ned_t m = {};
  m.time_boot_ms = parts_.now_ms;
  m.coordinate_frame = MAV_FRAME_LOCAL_NED;
  m.type_mask = kSetpointMask;
  m.z = s.depth;
  m.vx = parts_.companion.north_mps;
  m.vy = parts_.companion.east_mps;
  m.yaw = s.heading;
  return WRITE(POSITION_TARGET_LOCAL_NED, m);
}

bool Telemetry::controller() {
  mavlink_nav_controller_output_t m = {};
  m.nav_pitch = parts_.autopilot.pitch_target() * kToDegrees;
  m.nav_bearing = to_int16(parts_.attitude.yaw() * kToDegrees);
  m.target_bearing = to_int16(parts_.target.heading * kToDegrees);
  m.alt_error = -parts_.autopilot.depth_error();
  m.aspd_error = parts_.target.speed - parts_.speed.speed();
  return WRITE(NAV_CONTROLLER_OUTPUT, m);
}

bool Telemetry::servos() {
  mavlink_servo_output_raw_t m = {};
  m.time_usec = static_cast<uint32_t>(parts_.now_us);
  m.servo1_raw = parts_.actuators.pulse_us(Actuator::bow);
  m.servo2_raw = parts_.actuators.pulse_us(Actuator::stern);
  m.servo3_raw = parts_.actuators.pulse_us(Actuator::motor);
  return WRITE(SERVO_OUTPUT_RAW, m);
}

bool Telemetry::system_status() {
  constexpr uint32_t kInertial =
      MAV_SYS_STATUS_SENSOR_3D_GYRO | MAV_SYS_STATUS_SENSOR_3D_ACCEL | MAV_SYS_STATUS_SENSOR_3D_MAG;
  constexpr uint32_t kPressure = MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE;
  constexpr uint32_t kBattery = MAV_SYS_STATUS_SENSOR_BATTERY;
  const CauseSet active = parts_.safety.active();
  mavlink_sys_status_t m = {};
  m.onboard_control_sensors_present = kInertial | kPressure | kBattery;
  m.onboard_control_sensors_enabled = m.onboard_control_sensors_present;
  if (parts_.imu.state() == ImuState::running) m.onboard_control_sensors_health |= kInertial;
  if (parts_.depth_sensor.running()) m.onboard_control_sensors_health |= kPressure;
  if (!(active & (bit_of(Cause::battery_low) | bit_of(Cause::battery_critical))))
    m.onboard_control_sensors_health |= kBattery;
  m.load = to_uint16(static_cast<float>(parts_.loop.mean_us) * 0.1f);
  m.voltage_battery = to_uint16(parts_.power.voltage_v() * 1000.0f);
  m.current_battery = to_int16(parts_.power.current_a() * 100.0f);
  m.battery_remaining = parts_.power.remaining_percent(parts_.parameters);
  m.errors_comm = reader_.losses().bad_frames;
  m.errors_count1 = reader_.losses().gaps;
  m.errors_count2 = parts_.board.receive_overruns(Port::companion);
  m.errors_count3 = parts_.companion.setpoints_refused;
  return WRITE(SYS_STATUS, m);
}

bool Telemetry::battery() {
  mavlink_battery_status_t m = {};
  memset(m.voltages, 0xFF, sizeof m.voltages);
  m.voltages[0] = to_uint16(parts_.power.voltage_v() * 1000.0f);
  m.current_battery = to_int16(parts_.power.current_a() * 100.0f);
  m.current_consumed = static_cast<int32_t>(parts_.power.used_ah() * 1000.0f);
  m.energy_consumed = -1;
  m.temperature = 0x7FFF;
  m.battery_remaining = parts_.power.remaining_percent(parts_.parameters);
  return WRITE(BATTERY_STATUS, m);
}

bool Telemetry::memory() {
  mavlink_meminfo_t m = {};
  m.freemem = parts_.board.free_ram();
  m.freemem32 = m.freemem;
  return WRITE(MEMINFO, m);
}

// One of the loop's and the line's counters in turn.
bool Telemetry::named_value() {
  struct Named {
    char name[11];
    float value;
  };
  const LossCounters& losses = reader_.losses();
  const Named values[] = {
      {"tick_worst", static_cast<float>(parts_.loop.worst_us)},
      {"tick_mean", static_cast<float>(parts_.loop.mean_us)},
      {"ticks", static_cast<float>(parts_.loop.ticks)},
      {"tick_miss", static_cast<float>(parts_.loop.missed)},
      {"rx_bad", static_cast<float>(losses.bad_frames)},
      {"rx_gaps", static_cast<float>(losses.gaps)},
      {"rx_overrun", static_cast<float>(parts_.board.receive_overruns(Port::companion))},
      {"sp_refused", static_cast<float>(parts_.companion.setpoints_refused)},
  };
  mavlink_named_value_float_t m = {};
  m.time_boot_ms = parts_.now_ms;
  m.value = values[named_].value;
  memcpy(m.name, values[named_].name, sizeof m.name);
  if (!WRITE(NAMED_VALUE_FLOAT, m)) return false;
  named_ = static_cast<uint8_t>((named_ + 1) % (sizeof values / sizeof values[0]));
  return true;
}

bool Telemetry::timesync() {
  mavlink_timesync_t m = {};
  m.ts1 = static_cast<int64_t>(parts_.now_us) * 1000;
  return WRITE(TIMESYNC, m);
}

bool Telemetry::version() {
  const uint8_t hash[] = SHOAL_DIALECT_HASH;
  mavlink_autopilot_version_t m = {};
  m.capabilities = MAV_PROTOCOL_CAPABILITY_MAVLINK2 | MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST |
                   MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED | MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION;
  m.flight_sw_version = kFirmwareVersion;
  memcpy(m.middleware_custom_version, hash, sizeof hash);
  return WRITE(AUTOPILOT_VERSION, m);
}

}  // namespace shoal
