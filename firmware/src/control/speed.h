// Speed through water from throttle and battery voltage: the propeller against quadratic drag.
#pragma once

#include "../params/parameters.h"
#include "maths.h"

namespace shoal {

class SpeedModel {
 public:
  // Takes a new battery voltage and the parameters; a voltage that is not plausible counts as the nominal one.
  void set_battery(float battery_v, const Parameters& parameters);
  // Advances by `dt` at the throttle that is at the motor now (-1 to 1).
  void step(float throttle, float dt);

  float speed() const { return speed_; }  // m/s, forward
  // The speed at full throttle with this battery.
  float full_speed() const { return full_speed_; }

 private:
  float speed_ = 0.0f;
  float full_speed_ = 1.0f;
  float dead_ = 0.0f;
  float speed_per_pull_ = 1.0f;
  float per_length_ = 1.0f;
};

}  // namespace shoal
