// Thrust is taken as proportional to the square of throttle times voltage, so that speed is proportional to their
// product.
#include "speed.h"

namespace shoal {

void SpeedModel::set_battery(float battery_v, const Parameters& parameters) {
  const float nominal = parameters.get(Parameter::BAT_NOM_V);
  const float ratio = battery_v > 0.5f * nominal ? clamp(battery_v / nominal, 0.5f, 1.5f) : 1.0f;
  full_speed_ = parameters.get(Parameter::SPD_FULL) * ratio;
}

void SpeedModel::step(float throttle, const Parameters& parameters, float dt) {
  const float dead = parameters.get(Parameter::SPD_DEAD);
  const float pull = fmaxf(fabsf(throttle) - dead, 0.0f) / (1.0f - dead);
  const float steady = (throttle < 0.0f ? -pull : pull) * full_speed_;
  speed_ += (steady * fabsf(steady) - speed_ * fabsf(speed_)) * (dt / parameters.get(Parameter::SPD_LENGTH));
}

}  // namespace shoal
