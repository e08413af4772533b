// The filter's start from one sample, its gated corrections, and the integration of the quaternion.
#ifdef __AVR__
#pragma GCC optimize("O2")  // runs in every tick
#endif

#include "attitude.h"

namespace shoal {
namespace {

constexpr float kBiasLimit = 0.1f;                      // rad/s, above the data sheet's zero-rate output of 5 deg/s
constexpr float kFieldLow = 15.0f, kFieldHigh = 90.0f;  // uT; the earth's field is 22 to 67
constexpr float kHorizontalLow = 5.0f;                  // uT, below it the compass has no direction
constexpr float kForceLow = 0.9f * kGravity, kForceHigh = 1.1f * kGravity;
constexpr float kStartGain = 4.0f;  // times the usual gains while settling

bool plausible_force(float squared) { return squared > kForceLow * kForceLow && squared < kForceHigh * kForceHigh; }

bool plausible_field(float squared) { return squared > kFieldLow * kFieldLow && squared < kFieldHigh * kFieldHigh; }

}  // namespace

// Roll and pitch from gravity, yaw from the field turned level; false when either is implausible.
bool AttitudeEstimator::start(const ImuSample& sample) {
  const Vec3& f = sample.specific_force;
  const Vec3& m = sample.field;
  if (!sample.field_valid || !plausible_force(dot(f, f)) || !plausible_field(dot(m, m))) return false;
  const Vec3 down = f * (-1.0f / sqrtf(dot(f, f)));
  const Vec3 level = m - down * dot(m, down);
  const float horizontal = sqrtf(dot(level, level));
  if (horizontal < kHorizontalLow) return false;
  const Vec3 north = level * (1.0f / horizontal);
  const Vec3 east = cross(down, north);

  // The quaternion of the matrix with these rows, from the largest of its components.
  const float w = 1.0f + north.x + east.y + down.z;
  const float x = 1.0f + north.x - east.y - down.z;
  const float y = 1.0f - north.x + east.y - down.z;
  if (w > 1.0f) {
    q_ = {w, down.y - east.z, north.z - down.x, east.x - north.y};
  } else if (x > 1.0f) {
    q_ = {down.y - east.z, x, north.y + east.x, north.z + down.x};
  } else if (y > 1.0f) {
    q_ = {north.z - down.x, north.y + east.x, y, east.z + down.y};
  } else {
    q_ = {east.x - north.y, north.z + down.x, east.z + down.y, 1.0f - north.x - east.y + down.z};
  }
  const float scale = 1.0f / sqrtf(q_.w * q_.w + q_.x * q_.x + q_.y * q_.y + q_.z * q_.z);
  q_ = {q_.w * scale, q_.x * scale, q_.y * scale, q_.z * scale};
  return true;
}

void AttitudeEstimator::step(const ImuSample& sample, float speed, const Parameters& parameters, float dt) {
  if (!started_) {
    started_ = start(sample);
    find_axes();
    return;
  }
  rate_ = sample.rate - bias_;
  if (sample.field_read) {
    // This stands for the sample that goes uncorrected, too.
    const Vec3 twice = correction(sample, speed, parameters) * 2.0f;
    bias_ = bias_ - twice * (parameters.get(Parameter::ATT_KI) * dt);
    bias_ = {clamp(bias_.x, -kBiasLimit, kBiasLimit), clamp(bias_.y, -kBiasLimit, kBiasLimit),
             clamp(bias_.z, -kBiasLimit, kBiasLimit)};
    rotate(rate_ + twice, dt);
  } else {
    rotate(rate_, dt);
    normalize();
    find_axes();
    find_angles(parameters.get(Parameter::MAG_DECL) * kDegree);
  }
}

// The rate (rad/s, body) that turns the attitude towards what accelerometer and compass say.
Vec3 AttitudeEstimator::correction(const ImuSample& sample, float speed, const Parameters& parameters) {
  const float gain = settled() ? 1.0f : kStartGain;
  Vec3 turn = {0.0f, 0.0f, 0.0f};

  // Down as measured is the specific force reversed, without the centripetal part rate x (speed, 0, 0). Its length is
  // gravity's within the gate, so it need not be made a unit vector.
  const Vec3 f = sample.specific_force - Vec3{0.0f, rate_.z * speed, -rate_.y * speed};
  if (plausible_force(dot(f, f))) {
    turn = cross(down_, f) * (parameters.get(Parameter::ATT_KP) * gain * (1.0f / kGravity));
    if (!settled() && sample.field_valid) age_ += 0.02f;
  }

  // The field's level part must point north; its error turns the attitude about down only.
  const Vec3& m = sample.field;
  if (sample.field_valid && plausible_field(dot(m, m))) {
    const float north = dot(north_, m), east = dot(east_, m);
    const float n = fabsf(north), e = fabsf(east);
    const float horizontal = n > e ? n + 0.4f * e : e + 0.4f * n;  // within 8 % of the length
    if (horizontal > kHorizontalLow) {
      // Past a right angle the error stays at its largest.
      const float error = north > 0.0f ? east / horizontal : (east < 0.0f ? -1.0f : 1.0f);
      turn = turn - down_ * (error * parameters.get(Parameter::ATT_KM) * gain);
    }
  }
  return turn;
}

// First-order integration.
void AttitudeEstimator::rotate(const Vec3& rate, float dt) {
  const Vec3 h = rate * (0.5f * dt);
  const Quaternion p = q_;
  q_.w = p.w - p.x * h.x - p.y * h.y - p.z * h.z;
  q_.x = p.x + p.w * h.x + p.y * h.z - p.z * h.y;
  q_.y = p.y + p.w * h.y - p.x * h.z + p.z * h.x;
  q_.z = p.z + p.w * h.z + p.x * h.y - p.y * h.x;
}

// Brings the length back by one Newton step, exact enough for |q| near 1.
void AttitudeEstimator::normalize() {
  const float scale = 0.5f * (3.0f - (q_.w * q_.w + q_.x * q_.x + q_.y * q_.y + q_.z * q_.z));
  q_ = {q_.w * scale, q_.x * scale, q_.y * scale, q_.z * scale};
}

void AttitudeEstimator::find_axes() {
  const float x2 = q_.x + q_.x, y2 = q_.y + q_.y, z2 = q_.z + q_.z;
  const float xx = q_.x * x2, yy = q_.y * y2, zz = q_.z * z2;
  const float xy = q_.x * y2, xz = q_.x * z2, yz = q_.y * z2;
  const float wx = q_.w * x2, wy = q_.w * y2, wz = q_.w * z2;
  north_ = {1.0f - yy - zz, xy - wz, xz + wy};
  east_ = {xy + wz, 1.0f - xx - zz, yz - wx};
  down_ = {xz - wy, yz + wx, 1.0f - xx - yy};
}

void AttitudeEstimator::find_angles(float declination) {
  pitch_ = -asinf(clamp(down_.x, -1.0f, 1.0f));
  yaw_ = wrap_pi(atan2f(east_.x, north_.x) + declination);
}

}  // namespace shoal
