// Cascades with gains scheduled over speed, since a fin's force grows with its square; integrals stop at the limits.
#ifdef __AVR__
#pragma GCC optimize("O2")  // runs in every tick
#endif

#include "autopilot.h"

namespace shoal {
namespace {

constexpr float kReferenceSpeed = 0.5f;  // m/s at which the pitch gains hold
constexpr float kFinReach = 0.5f;        // share of the rudder's range that its integral may take
constexpr float kPitchReach = 0.8f;      // share of the pitch range that its integral may take

// The throttle that holds a speed, from where the propeller begins to pull.
float throttle(float speed, float full_speed, const Parameters& parameters) {
  if (speed == 0.0f) return 0.0f;
  const float dead = parameters.get(Parameter::SPD_DEAD);
  const float share = dead + (1.0f - dead) * fabsf(speed) / full_speed;
  return clamp(speed > 0.0f ? share : -share, -1.0f, 1.0f);
}

}  // namespace

Effort Autopilot::step(const Navigation& now, const Setpoint& setpoint, const Parameters& parameters, float dt) {
  Effort effort;
  const float steerage = parameters.get(Parameter::SPD_STEER);
  const Way way = {1.0f / fmaxf(fabsf(now.speed), steerage), fabsf(now.speed) > 0.5f * steerage};
  effort.rudder = steer(now, setpoint.heading, way, parameters, dt);
  effort.plane = dive(now, setpoint.depth, way, parameters, dt);
  effort.throttle = throttle(setpoint.speed, now.full_speed, parameters);
  return effort;
}

// Heading error to yaw rate, yaw rate to rudder.
float Autopilot::steer(const Navigation& now, float heading, const Way& way, const Parameters& parameters, float dt) {
  const float limit = parameters.get(Parameter::FIN_LIMIT) * kDegree;
  heading_error_ = wrap_pi(heading - now.yaw);

  // Turns are yaw rates over speed, the inverse of a radius.
  const float tightest = parameters.get(Parameter::HDG_RATE);
  const float turn = clamp(parameters.get(Parameter::HDG_P) * heading_error_ * way.per_speed, -tightest, tightest);
  const float error = turn - now.rate.z * way.per_speed;
  const float wanted = parameters.get(Parameter::YAW_FF) * turn + parameters.get(Parameter::YAW_P) * error;
  const float rudder = wanted + yaw_integral_;

  const bool winding_up = fabsf(rudder) >= limit && rudder * error > 0.0f;
  if (!winding_up && way.made) {
    yaw_integral_ += parameters.get(Parameter::YAW_I) * error * dt;
    yaw_integral_ = clamp(yaw_integral_, -kFinReach * limit, kFinReach * limit);
  }
  return clamp(rudder, -limit, limit);
}

// Depth error to vertical speed, vertical speed to pitch, pitch to planes.
float Autopilot::dive(const Navigation& now, float depth, const Way& way, const Parameters& parameters, float dt) {
  const float limit = parameters.get(Parameter::FIN_LIMIT) * kDegree;
  const float steepest = parameters.get(Parameter::PITCH_MAX) * kDegree;
  depth_error_ = depth - now.depth;

  // Slopes are vertical speeds over speed, down positive; a small one is the sine of the pitch, reversed.
  const float fastest = parameters.get(Parameter::DEP_RATE);
  const float slope = clamp(parameters.get(Parameter::DEP_P) * depth_error_ * way.per_speed, -fastest, fastest);
  const float slope_error = slope - now.descent * way.per_speed;
  const float pitch = -(slope + parameters.get(Parameter::DEP_W) * slope_error + slope_integral_);
  pitch_target_ = clamp(pitch, -steepest, steepest);

  float gain = kReferenceSpeed * way.per_speed;
  gain *= gain;
  const float plane = gain * (parameters.get(Parameter::PITCH_P) * (pitch_target_ - now.pitch) -
                              parameters.get(Parameter::PITCH_D) * now.rate.y);

  const bool at_limit = fabsf(plane) >= limit || fabsf(pitch) >= steepest;
  const bool winding_up = at_limit && pitch * slope_error < 0.0f;
  if (!winding_up && way.made) {
    slope_integral_ += parameters.get(Parameter::DEP_I) * slope_error * dt;
    slope_integral_ = clamp(slope_integral_, -kPitchReach * steepest, kPitchReach * steepest);
  }
  return clamp(plane, -limit, limit);
}

}  // namespace shoal
