// Converts the analog readings to volts, amperes and ampere hours.
#include "power.h"

#include "../control/maths.h"
#include "../pins.h"

namespace shoal {
namespace {

constexpr float kVoltsPerCount = 5.0f / 1023.0f;
constexpr float kTimeConstant = 0.5f;  // s

}  // namespace

void Power::step(float dt) {
  const float volts =
      static_cast<float>(board_.read_analog(Analog::battery_voltage)) * (kVoltsPerCount * SHOAL_BATTERY_VOLTS_PER_VOLT);
  const float amps =
      static_cast<float>(board_.read_analog(Analog::battery_current)) * (kVoltsPerCount * SHOAL_BATTERY_AMPS_PER_VOLT);
  const float share = first_ ? 1.0f : dt / (kTimeConstant + dt);
  first_ = false;
  voltage_v_ += (volts - voltage_v_) * share;
  current_a_ += (amps - current_a_) * share;
  used_ah_ += current_a_ * dt * (1.0f / 3600.0f);
  leak_ = board_.leak_detected();
}

int8_t Power::remaining_percent(const Parameters& parameters) const {
  const float share = 1.0f - used_ah_ / parameters.get(Parameter::BAT_CAP_AH);
  return static_cast<int8_t>(clamp(share, 0.0f, 1.0f) * 100.0f);
}

}  // namespace shoal
