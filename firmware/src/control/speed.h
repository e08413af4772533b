// Speed through water from throttle and battery voltage: the propeller against quadratic drag.
#pragma once

#include "../params/parameters.h"
#include "maths.h"

namespace shoal {

class SpeedModel {
 public:
  // Advances by `dt` at the throttle that is at the motor now (-1 to 1).
  void step(float throttle, float battery_v, const Parameters& parameters, float dt);
  float speed() const { return speed_; }  // m/s, forward

  // The throttle that holds a speed at this battery voltage.
  static float throttle_for(float speed, float battery_v, const Parameters& parameters);

 private:
  float speed_ = 0.0f;
};

}  // namespace shoal
