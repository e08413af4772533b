// Thrust is taken as proportional to the square of throttle times voltage, so that speed is proportional to their
// product.
#include "speed.h"

namespace shoal {

void SpeedModel::set_battery(float battery_v, const Parameters& parameters) {
  const float nominal = parameters.get(Parameter::BAT_NOM_V);
  const float ratio = battery_v > 0.5f * nominal ? clamp(battery_v / nominal, 0.5f, 1.5f) : 1.0f;
  full_speed_ = parameters.get(Parameter::SPD_FULL) * ratio;
  dead_ = parameters.get(Parameter::SPD_DEAD);
  speed_per_pull_ = full_speed_ / (1.0f - dead_);
  per_length_ = 1.0f / parameters.get(Parameter::SPD_LENGTH);
}

void SpeedModel::step(float throttle, float dt) {
  const float pull = fmaxf(fabsf(throttle) - dead_, 0.0f);
  const float steady = (throttle < 0.0f ? -pull : pull) * speed_per_pull_;
  speed_ += (steady * fabsf(steady) - speed_ * fabsf(speed_)) * per_length_ * dt;
}

}  // namespace shoal
