// Attitude from gyroscope, accelerometer and compass: Mahony's complementary filter on a quaternion with gyroscope
// bias.
#pragma once

#include "../drivers/icm20948.h"
#include "../params/parameters.h"
#include "maths.h"

namespace shoal {

class AttitudeEstimator {
 public:
  // Advances by `dt` with a new sample; `speed` (m/s, forward) takes the centripetal part out of the accelerometer.
  // Samples with a compass reading correct the filter, the others bring the angles up to date: half the work each.
  void step(const ImuSample& sample, float speed, const Parameters& parameters, float dt);
  // Forgets everything, as after an IMU that was silent.
  void reset() { *this = AttitudeEstimator(); }

  // True once the filter has settled on gravity and on a plausible field.
  bool settled() const { return age_ >= kSettleTime; }
  float roll() const { return atan2f(down_.y, down_.z); }
  float pitch() const { return pitch_; }
  float yaw() const { return yaw_; }          // rad from true north
  const Vec3& rate() const { return rate_; }  // rad/s, body, bias taken off
  const Vec3& bias() const { return bias_; }

 private:
  static constexpr float kSettleTime = 1.0f;  // s

  bool start(const ImuSample& sample);
  Vec3 correction(const ImuSample& sample, float speed, const Parameters& parameters);
  void rotate(const Vec3& rate, float dt);
  void normalize();
  void find_axes();
  void find_angles(float declination);

  Quaternion q_ = {1.0f, 0.0f, 0.0f, 0.0f};  // body in magnetic north, east, down
  Vec3 bias_ = {0.0f, 0.0f, 0.0f};
  Vec3 rate_ = {0.0f, 0.0f, 0.0f};
  // Magnetic north, east and down as unit vectors in the body frame: the rows of the rotation matrix, as of the last
  // sample without compass.
  Vec3 north_ = {1.0f, 0.0f, 0.0f};
  Vec3 east_ = {0.0f, 1.0f, 0.0f};
  Vec3 down_ = {0.0f, 0.0f, 1.0f};
  float pitch_ = 0.0f;
  float yaw_ = 0.0f;
  float age_ = 0.0f;
  bool started_ = false;
};

}  // namespace shoal
