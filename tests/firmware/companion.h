// The companion's end of the line for unit tests: packs with the generated code, keeps what the vehicle said.
#pragma once

#include <math.h>

#include <string>
#include <vector>

#include "fake_board.h"
#include "firmware/src/link/frame.h"
#include "firmware/src/link/mavlink.h"
#include "firmware/src/vehicle.h"

namespace shoal {

// A vehicle on a fake board with a companion on its line.
class Rig {
 public:
  FakeBoard board;
  Vehicle vehicle{board};
  uint8_t component = MAV_COMP_ID_ONBOARD_COMPUTER;
  uint8_t target = 1;
  bool beats = true;  // sends a heartbeat a second
  std::vector<std::string> texts;
  std::vector<mavlink_command_ack_t> acks;
  std::vector<mavlink_param_value_t> values;
  std::vector<mavlink_autopilot_version_t> versions;
  unsigned frames = 0;

  Rig() { vehicle.begin(); }

  // Runs the vehicle for so many ticks of 10 ms.
  void run(double seconds) {
    for (int n = static_cast<int>(lround(seconds * 100)); n > 0; --n) {
      if (beats && ticks_++ % 100 == 0) heartbeat();
      board.advance_ms(10);
      vehicle.tick();
      listen();
    }
  }

  void heartbeat() {
    mavlink_heartbeat_t m = {};
    m.type = MAV_TYPE_ONBOARD_CONTROLLER;
    m.mavlink_version = 3;
    mavlink_message_t packed;
    mavlink_msg_heartbeat_encode_status(1, component, &status_, &packed, &m);
    put(packed);
  }
  void version(const uint8_t hash[8]) {
    mavlink_autopilot_version_t m = {};
    memcpy(m.middleware_custom_version, hash, 8);
    mavlink_message_t packed;
    mavlink_msg_autopilot_version_encode_status(1, component, &status_, &packed, &m);
    put(packed);
  }
  void command(uint16_t number, float p1 = 0, float p2 = 0) {
    mavlink_command_long_t m = {};
    m.command = number;
    m.param1 = p1;
    m.param2 = p2;
    m.target_system = target;
    m.target_component = 1;
    mavlink_message_t packed;
    mavlink_msg_command_long_encode_status(1, component, &status_, &packed, &m);
    put(packed);
  }
  static mavlink_set_position_target_local_ned_t setpoint_of(float heading, float depth, float speed) {
    mavlink_set_position_target_local_ned_t m = {};
    m.z = depth;
    m.vx = speed * cosf(heading);
    m.vy = speed * sinf(heading);
    m.yaw = heading;
    m.type_mask = 0x09E3;
    m.target_system = 1;
    m.target_component = 1;
    m.coordinate_frame = MAV_FRAME_LOCAL_NED;
    return m;
  }
  void setpoint(const mavlink_set_position_target_local_ned_t& m) {
    mavlink_message_t packed;
    mavlink_msg_set_position_target_local_ned_encode_status(1, component, &status_, &packed, &m);
    put(packed);
  }
  void setpoint(float heading, float depth, float speed) { setpoint(setpoint_of(heading, depth, speed)); }
  void set_parameter(const char* name, float value) {
    mavlink_param_set_t m = {};
    strncpy(m.param_id, name, sizeof m.param_id);
    m.param_value = value;
    m.param_type = MAV_PARAM_TYPE_REAL32;
    m.target_system = target;
    m.target_component = 1;
    mavlink_message_t packed;
    mavlink_msg_param_set_encode_status(1, component, &status_, &packed, &m);
    put(packed);
  }
  void put(const mavlink_message_t& packed) {
    uint8_t bytes[MAVLINK_MAX_PACKET_LEN];
    const uint16_t count = mavlink_msg_to_send_buffer(bytes, &packed);
    board.arriving.insert(board.arriving.end(), bytes, bytes + count);
  }

  // Runs until the sensors have settled and arms as a companion of the same dialect does.
  void arm() {
    const uint8_t own[] = SHOAL_DIALECT_HASH;
    run(3);
    version(own);
    command(MAV_CMD_COMPONENT_ARM_DISARM, 1);
    run(0.1);
  }
  // Runs while a setpoint arrives ten times a second.
  void drive(double seconds, float heading, float depth, float speed) {
    for (int n = static_cast<int>(lround(seconds * 10)); n > 0; --n) {
      setpoint(heading, depth, speed);
      run(0.1);
    }
  }

  Mode mode() const { return vehicle.parts().safety.mode(); }
  bool heard(const std::string& text) const {
    for (const std::string& t : texts)
      if (t == text) return true;
    return false;
  }

 private:
  void listen() {
    Frame frame;
    for (uint8_t byte : board.sent) {
      if (!reader_.push(byte)) continue;
      while (reader_.next(frame)) keep(frame);
    }
    board.sent.clear();
  }
  void keep(const Frame& frame) {
    ++frames;
    if (frame.id == MAVLINK_MSG_ID_STATUSTEXT) {
      const auto m = frame.as<mavlink_statustext_t>();
      texts.emplace_back(m.text, strnlen(m.text, sizeof m.text));
    }
    if (frame.id == MAVLINK_MSG_ID_COMMAND_ACK) acks.push_back(frame.as<mavlink_command_ack_t>());
    if (frame.id == MAVLINK_MSG_ID_PARAM_VALUE) values.push_back(frame.as<mavlink_param_value_t>());
    if (frame.id == MAVLINK_MSG_ID_AUTOPILOT_VERSION) versions.push_back(frame.as<mavlink_autopilot_version_t>());
  }

  FrameReader reader_;
  mavlink_status_t status_ = {};
  unsigned ticks_ = 0;
};

}  // namespace shoal
