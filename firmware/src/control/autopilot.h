// Heading, depth and speed loops: from a setpoint to rudder, plane and throttle effort.
#pragma once

#include "../params/parameters.h"
#include "maths.h"

namespace shoal {

// What the vehicle holds; the one thing that a companion effort.
struct Setpoint {
  float heading;  // rad
  float depth;    // m
  float speed;    // m/s through water, forward
};

// What the estimators know.
struct Navigation {
  float pitch, yaw;  // rad
  Vec3 rate;         // rad/s, body
  float depth;       // m
  float descent;     // m/s
  float speed;       // m/s
  float full_speed;  // m/s, at full throttle
};

struct Effort {
  float rudder;    // rad, positive turns to starboard
  float plane;     // rad, positive pitches the bow up
  float throttle;  // -1 to 1
};

class Autopilot {
 public:
  // Forgets integrals, as on arming.
  void reset() { *this = Autopilot(); }
  Effort step(const Navigation& now, const Setpoint& setpoint, const Parameters& parameters, float dt);

  float heading_error() const { return heading_error_; }  // rad
  float depth_error() const { return depth_error_; }      // m
  float pitch_target() const { return pitch_target_; }    // rad

 private:
  // The way that fins work with.
  struct Way {
    float per_speed;  // 1 over the speed, which counts as steerage way at least
    bool made;        // enough for the integrals to learn from
  };

  float steer(const Navigation& now, float heading, const Way& way, const Parameters& parameters, float dt);
  float dive(const Navigation& now, float depth, const Way& way, const Parameters& parameters, float dt);

  float heading_error_ = 0.0f;
  float depth_error_ = 0.0f;
  float pitch_target_ = 0.0f;
  float yaw_integral_ = 0.0f;
  float slope_integral_ = 0.0f;
};

}  // namespace shoal
