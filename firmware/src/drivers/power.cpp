// Converts the analog readings to volts, amperes and ampere hours.
#include "power.h"

#include "../pins.h"

namespace shoal {
namespace {

constexpr float kVoltsPerCount = 5.0f / 1023.0f;
constexpr float kTimeConstant = 0.5f;  // s

}  // namespace

void Power::step(float dt) {
  const float volts = static_cast<float>(board_.read_analog(Analog::battery_voltage)) *
                      (kVoltsPerCount * SHOAL_BATTERY_VOLTS_PER_VOLT);
  const float amps =
      static_cast<float>(board_.read_analog(Analog::battery_current)) * (kVoltsPerCount * SHOAL_BATTERY_AMPS_PER_VOLT);
  const float share = first_ ? 1.0f : dt / (kTimeConstant + dt);
  first_ = false;
  voltage_v_ += (volts - voltage_v_) * share;
  current_a_ += (amps - current_a_) * share;
  used_ah_ += current_a_ * dt / 3600.0f;
  leak_ = board_.leak_detected();
}

}  // namespace shoal
