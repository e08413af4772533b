// What a vehicle is made of, apart from its link: the rooms that the tick moves data between.
#pragma once

#include <stdint.h>

#include "board.h"
#include "control/attitude.h"
#include "control/autopilot.h"
#include "control/speed.h"
#include "control/vertical.h"
#include "drivers/actuators.h"
#include "drivers/icm20948.h"
#include "drivers/ms5837.h"
#include "drivers/power.h"
#include "params/parameters.h"
#include "safety/safety.h"

namespace shoal {

constexpr uint8_t kTickMs = 10;
constexpr float kTick = 0.01f;  // s

// How well the loop keeps its 100 Hz.
struct LoopStatistics {
  uint32_t ticks;
  uint32_t missed;
  uint16_t worst_us;
  uint16_t mean_us;  // first-order low pass over 32 ticks
};

// The companion's words that steer the vehicle; `age_ms` saturate.
struct Companion {
  Setpoint setpoint;
  float north_mps, east_mps;  // the setpoint's speed as it was sent
  uint16_t setpoint_age_ms;
  uint16_t heartbeat_age_ms;
  uint16_t setpoints_refused;
};

struct Parts {
  explicit Parts(Board& a_board)
      : board(a_board), imu(a_board), depth_sensor(a_board), power(a_board), actuators(a_board) {}

  uint8_t system() const { return static_cast<uint8_t>(parameters.get(Parameter::SYS_ID)); }

  Board& board;
  uint64_t now_us = 0;  // since reset, at the beginning of this tick
  uint32_t now_ms = 0;
  Parameters parameters;
  Icm20948 imu;
  Ms5837 depth_sensor;
  Power power;
  Actuators actuators;
  AttitudeEstimator attitude;
  DepthEstimator depth;
  SpeedModel speed;
  Autopilot autopilot;
  Safety safety;
  Companion companion = {{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f, 0xFFFF, 0xFFFF, 0};
  Setpoint target = {0.0f, 0.0f, 0.0f};  // what control works towards now
  LoopStatistics loop = {};
  uint16_t reboot_in_ms = 0;  // 0: no restart asked for
};

}  // namespace shoal
