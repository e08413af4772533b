// Cascades with gains scheduled over speed, since a fin's force grows with its square; integrals stop at the limits.
#include "autopilot.h"

namespace shoal {
namespace {

constexpr float kReferenceSpeed = 0.5f;  // m/s at which the pitch gains hold
constexpr float kFinReach = 0.5f;        // share of the fin's range that an integral may take

}  // namespace

Effort Autopilot::step(const Navigation& now, const Setpoint& setpoint, const Parameters& parameters, float dt) {
  Effort effort;
  effort.rudder = steer(now, setpoint.heading, parameters, dt);
  effort.plane = dive(now, setpoint.depth, parameters, dt);
  effort.throttle = clamp(setpoint.speed / now.full_speed, -1.0f, 1.0f);
  return effort;
}

// Heading error to yaw rate, yaw rate to rudder.
float Autopilot::steer(const Navigation& now, float heading, const Parameters& parameters, float dt) {
  const float limit = parameters.get(Parameter::FIN_LIMIT) * kDegree;
  const float speed = fmaxf(fabsf(now.speed), parameters.get(Parameter::SPD_STEER));
  const float way = 1.0f / speed;
  heading_error_ = wrap_pi(heading - now.yaw);

  const float fastest = parameters.get(Parameter::HDG_RATE) * speed;
  const float rate = clamp(parameters.get(Parameter::HDG_P) * heading_error_, -fastest, fastest);
  const float error = rate - now.rate.z;
  const float wanted = (parameters.get(Parameter::YAW_FF) * rate + parameters.get(Parameter::YAW_P) * error) * way;
  const float rudder = wanted + yaw_integral_;

  const bool winding_up = fabsf(rudder) >= limit && rudder * error > 0.0f;
  if (!winding_up && fabsf(now.speed) > 0.5f * speed) {
    yaw_integral_ += parameters.get(Parameter::YAW_I) * error * way * dt;
    yaw_integral_ = clamp(yaw_integral_, -kFinReach * limit, kFinReach * limit);
  }
  return clamp(rudder, -limit, limit);
}

// Depth error to vertical speed, vertical speed to pitch, pitch to planes.
float Autopilot::dive(const Navigation& now, float depth, const Parameters& parameters, float dt) {
  const float limit = parameters.get(Parameter::FIN_LIMIT) * kDegree;
  const float steepest = parameters.get(Parameter::PITCH_MAX) * kDegree;
  const float speed = fmaxf(fabsf(now.speed), parameters.get(Parameter::SPD_STEER));
  const float way = 1.0f / speed;
  const bool has_way = fabsf(now.speed) > 0.5f * speed;
  depth_error_ = depth - now.depth;

  // A descent of `wanted` needs the sine of the pitch at -wanted / speed.
  const float wanted = parameters.get(Parameter::DEP_P) * depth_error_ + depth_integral_;
  const float pitch = -wanted * way;
  pitch_target_ = clamp(pitch, -steepest, steepest);
  const bool climbing_up = fabsf(pitch) >= steepest && wanted * depth_error_ > 0.0f;

  float gain = kReferenceSpeed * way;
  gain *= gain;
  const float error = pitch_target_ - now.pitch;
  const float plane =
      (parameters.get(Parameter::PITCH_P) * error - parameters.get(Parameter::PITCH_D) * now.rate.y) * gain +
      pitch_integral_;
  const bool winding_up = fabsf(plane) >= limit && plane * error > 0.0f;

  if (has_way && !climbing_up && !winding_up) {
    depth_integral_ += parameters.get(Parameter::DEP_I) * depth_error_ * dt;
    depth_integral_ = clamp(depth_integral_, -kFinReach * speed * steepest, kFinReach * speed * steepest);
  }
  if (has_way && !winding_up) {
    pitch_integral_ += parameters.get(Parameter::PITCH_I) * error * gain * dt;
    pitch_integral_ = clamp(pitch_integral_, -kFinReach * limit, kFinReach * limit);
  }
  return clamp(plane, -limit, limit);
}

}  // namespace shoal
