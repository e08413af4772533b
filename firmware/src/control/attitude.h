// Attitude from gyroscope, accelerometer and compass: Mahony's complementary filter on a quaternion with gyroscope
// bias.
#pragma once

#include "../drivers/icm20948.h"
#include "../params/parameters.h"
#include "maths.h"

namespace shoal {

struct Euler {
  float roll, pitch, yaw;  // rad; mission frame to body, order yaw, pitch, roll
};

class AttitudeEstimator {
 public:
  // Advances by `dt` with a new sample; `speed` (m/s, forward) takes the centripetal part out of the accelerometer.
  void step(const ImuSample& sample, float speed, const Parameters& parameters, float dt);
  // Forgets everything, as after an IMU that was silent.
  void reset() { *this = AttitudeEstimator(); }

  // True once the filter has settled on gravity and on a plausible field.
  bool settled() const { return age_ >= kSettleTime; }
  const Euler& euler() const { return euler_; }
  const Vec3& rate() const { return rate_; }  // rad/s, body, bias taken off
  const Vec3& bias() const { return bias_; }
  const Quaternion& quaternion() const { return q_; }
  // The body's vertical, down positive, as unit vector in the body frame.
  const Vec3& down() const { return down_; }

 private:
  static constexpr float kSettleTime = 1.0f;  // s

  bool start(const ImuSample& sample, float declination);
  void rotate(const Vec3& rate, float dt);
  void derive();

  Quaternion q_ = {1.0f, 0.0f, 0.0f, 0.0f};
  Vec3 bias_ = {0.0f, 0.0f, 0.0f};
  Vec3 rate_ = {0.0f, 0.0f, 0.0f};
  Vec3 down_ = {0.0f, 0.0f, 1.0f};
  Euler euler_ = {0.0f, 0.0f, 0.0f};
  float age_ = 0.0f;
  bool started_ = false;
};

}  // namespace shoal
