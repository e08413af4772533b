// Thrust is taken as proportional to the square of throttle times voltage, so that speed is proportional to their
// product.
#include "speed.h"

namespace shoal {
namespace {

// Full-throttle speed at this battery; without a plausible voltage the nominal one is taken.
float full_speed(float battery_v, const Parameters& parameters) {
  const float nominal = parameters.get(Parameter::BAT_NOM_V);
  const float ratio = battery_v > 0.5f * nominal ? clamp(battery_v / nominal, 0.5f, 1.5f) : 1.0f;
  return parameters.get(Parameter::SPD_FULL) * ratio;
}

}  // namespace

void SpeedModel::step(float throttle, float battery_v, const Parameters& parameters, float dt) {
  const float steady = throttle * full_speed(battery_v, parameters);
  const float acceleration = (steady * fabsf(steady) - speed_ * fabsf(speed_)) / parameters.get(Parameter::SPD_LENGTH);
  speed_ += acceleration * dt;
}

float SpeedModel::throttle_for(float speed, float battery_v, const Parameters& parameters) {
  return clamp(speed / full_speed(battery_v, parameters), -1.0f, 1.0f);
}

}  // namespace shoal
