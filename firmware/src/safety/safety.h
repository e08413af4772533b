// Arming and failsafes: what is wrong, since when, what the vehicle does about it, and what it refuses.
#pragma once

#include <stdint.h>

#include "../drivers/icm20948.h"
#include "../params/parameters.h"

namespace shoal {

enum class Mode : uint8_t { disarmed, armed, failsafe, terminated };

// What a cause makes an armed vehicle do; of several the last in this order wins.
enum class Action : uint8_t {
  none,
  hold,     // heading and depth at zero thrust, until the cause clears
  surface,  // drive up, then float; until re-armed
  stop,     // everything neutral: the vehicle is trimmed light and floats up; until re-armed
};

// One row each in the table of safety.cpp, in the same order.
enum class Cause : uint8_t {
  imu_silent,
  imu_frozen,
  attitude_unsettled,
  depth_silent,
  battery_low,
  battery_critical,
  leak,
  too_deep,
  setpoint_stale,
  setpoint_lost,
  companion_lost,
  count
};
constexpr uint8_t kCauseCount = static_cast<uint8_t>(Cause::count);
using CauseSet = uint16_t;
constexpr CauseSet bit_of(Cause cause) { return static_cast<CauseSet>(1U << static_cast<uint8_t>(cause)); }

// What the rooms report to safety each tick. Ages are in ms and saturate.
struct Health {
  ImuState imu;
  bool attitude_settled;
  bool depth_running;
  float depth;
  float battery_v;
  bool leak;
  uint16_t setpoint_age_ms;
  uint16_t heartbeat_age_ms;
};

constexpr uint8_t kCauseTextLength = 28;

class Safety {
 public:
  // Judges every row; call once a tick.
  void step(const Health& health, const Parameters& parameters, uint16_t dt_ms);

  // Arms, or re-arms from a failsafe, and returns true; else nothing changes and `refusals` says why.
  bool arm();
  void disarm();
  // Ends the mission for good: neutral outputs until a restart.
  void terminate() { mode_ = Mode::terminated; }

  Mode mode() const { return mode_; }
  // Time since arming, saturating.
  uint16_t armed_ms() const { return armed_ms_; }
  // What an armed or failed vehicle has to do now.
  Action action() const;
  bool driving() const { return mode_ == Mode::armed || mode_ == Mode::failsafe; }

  CauseSet active() const { return active_; }
  // The causes that would refuse arming now.
  CauseSet refusals() const;

  // Copies a cause's text, terminated; returns the MAVLink severity of its setting.
  static uint8_t describe(Cause cause, char text[kCauseTextLength]);

 private:
  bool holds(Cause cause, bool was, const Health& health, const Parameters& parameters) const;

  Mode mode_ = Mode::disarmed;
  Action latched_ = Action::none;
  Action recoverable_ = Action::none;
  CauseSet present_ = 0;  // conditions that hold now
  CauseSet active_ = 0;   // conditions that held long enough, and have not been gone long enough
  uint16_t since_ms_[kCauseCount] = {};
  uint16_t armed_ms_ = 0;
};

}  // namespace shoal
