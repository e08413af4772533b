// The filter's start from one sample, its gated corrections, and the integration of the quaternion.
#include "attitude.h"

namespace shoal {
namespace {

constexpr float kBiasLimit = 0.1f;                      // rad/s, above the data sheet's zero-rate output of 5 deg/s
constexpr float kFieldLow = 15.0f, kFieldHigh = 90.0f;  // uT; the earth's field is 22 to 67
constexpr float kHorizontalLow = 5.0f;                  // uT, below it the compass has no direction
constexpr float kForceTolerance = 0.2f;                 // of g
constexpr float kStartGain = 4.0f;                      // times the usual gains while settling

bool plausible_force(float magnitude) {
  return magnitude > (1.0f - kForceTolerance) * kGravity && magnitude < (1.0f + kForceTolerance) * kGravity;
}

bool plausible_field(float squared) { return squared > kFieldLow * kFieldLow && squared < kFieldHigh * kFieldHigh; }

}  // namespace

// Roll and pitch from gravity, yaw from the field turned level; false when either is implausible.
bool AttitudeEstimator::start(const ImuSample& sample, float declination) {
  const Vec3& f = sample.specific_force;
  const Vec3& m = sample.field;
  if (!sample.field_fresh || !plausible_force(sqrtf(dot(f, f))) || !plausible_field(dot(m, m))) return false;
  const float roll = atan2f(-f.y, -f.z);
  const float pitch = atan2f(f.x, sqrtf(f.y * f.y + f.z * f.z));
  const float sr = sinf(roll), cr = cosf(roll), sp = sinf(pitch), cp = cosf(pitch);
  const float north = m.x * cp + (m.y * sr + m.z * cr) * sp;
  const float east = m.y * cr - m.z * sr;
  const float yaw = atan2f(-east, north) + declination;

  const float a = sinf(roll * 0.5f), b = cosf(roll * 0.5f);
  const float c = sinf(pitch * 0.5f), d = cosf(pitch * 0.5f);
  const float e = sinf(yaw * 0.5f), g = cosf(yaw * 0.5f);
  q_ = {b * d * g + a * c * e, a * d * g - b * c * e, b * c * g + a * d * e, b * d * e - a * c * g};
  return true;
}

void AttitudeEstimator::step(const ImuSample& sample, float speed, const Parameters& parameters, float dt) {
  const float declination = parameters.get(Parameter::MAG_DECL) * kDegree;
  if (!started_) {
    started_ = start(sample, declination);
    if (started_) derive();
    return;
  }
  const float gain = settled() ? 1.0f : kStartGain;
  rate_ = sample.rate - bias_;
  Vec3 correction = {0.0f, 0.0f, 0.0f};
  bool gravity_seen = false;

  // Down as measured: the specific force without the centripetal part rate x (speed, 0, 0), reversed.
  const Vec3 f = sample.specific_force - Vec3{0.0f, rate_.z * speed, -rate_.y * speed};
  const float force = sqrtf(dot(f, f));
  if (plausible_force(force)) {
    correction = cross(f * (-1.0f / force), down_) * (parameters.get(Parameter::ATT_KP) * gain);
    gravity_seen = true;
  }

  // The field's horizontal part must point to magnetic north; its error turns the attitude about down only.
  const Vec3& m = sample.field;
  if (sample.field_fresh && plausible_field(dot(m, m))) {
    const float north = (1.0f - 2.0f * (q_.y * q_.y + q_.z * q_.z)) * m.x + 2.0f * (q_.x * q_.y - q_.w * q_.z) * m.y +
                        2.0f * (q_.x * q_.z + q_.w * q_.y) * m.z;
    const float east = 2.0f * (q_.x * q_.y + q_.w * q_.z) * m.x + (1.0f - 2.0f * (q_.x * q_.x + q_.z * q_.z)) * m.y +
                       2.0f * (q_.y * q_.z - q_.w * q_.x) * m.z;
    const float horizontal = sqrtf(north * north + east * east);
    if (horizontal > kHorizontalLow) {
      const float n = north / horizontal, e = east / horizontal;
      // Sine and cosine of the heading error; past a right angle the error stays at its largest.
      float error = e, along = n;
      if (declination != 0.0f) {
        const float s = sinf(declination), c = cosf(declination);
        error = e * c - n * s;
        along = n * c + e * s;
      }
      if (along < 0.0f) error = error < 0.0f ? -1.0f : 1.0f;
      correction = correction - down_ * (error * parameters.get(Parameter::ATT_KM) * gain);
    }
  }

  const float ki = parameters.get(Parameter::ATT_KI) * gain * dt;
  bias_ = bias_ - correction * ki;
  bias_ = {clamp(bias_.x, -kBiasLimit, kBiasLimit), clamp(bias_.y, -kBiasLimit, kBiasLimit),
           clamp(bias_.z, -kBiasLimit, kBiasLimit)};
  rotate(rate_ + correction, dt);
  derive();
  if (gravity_seen && !settled()) age_ += dt;
}

// First-order integration; the length is brought back by one Newton step, exact enough for |q| near 1.
void AttitudeEstimator::rotate(const Vec3& rate, float dt) {
  const Vec3 h = rate * (0.5f * dt);
  const Quaternion p = q_;
  q_.w = p.w - p.x * h.x - p.y * h.y - p.z * h.z;
  q_.x = p.x + p.w * h.x + p.y * h.z - p.z * h.y;
  q_.y = p.y + p.w * h.y - p.x * h.z + p.z * h.x;
  q_.z = p.z + p.w * h.z + p.x * h.y - p.y * h.x;
  const float length2 = q_.w * q_.w + q_.x * q_.x + q_.y * q_.y + q_.z * q_.z;
  const float scale = 0.5f * (3.0f - length2);
  q_ = {q_.w * scale, q_.x * scale, q_.y * scale, q_.z * scale};
}

void AttitudeEstimator::derive() {
  down_ = {2.0f * (q_.x * q_.z - q_.w * q_.y), 2.0f * (q_.y * q_.z + q_.w * q_.x),
           1.0f - 2.0f * (q_.x * q_.x + q_.y * q_.y)};
  euler_.roll = atan2f(down_.y, down_.z);
  euler_.pitch = -asinf(clamp(down_.x, -1.0f, 1.0f));
  euler_.yaw = atan2f(2.0f * (q_.x * q_.y + q_.w * q_.z), 1.0f - 2.0f * (q_.y * q_.y + q_.z * q_.z));
}

}  // namespace shoal
