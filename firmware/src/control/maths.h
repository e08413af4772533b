// Three-vectors, unit quaternions and angle helpers in single precision.
#pragma once

#include <math.h>

namespace shoal {

constexpr float kPi = 3.14159265f;
constexpr float kGravity = 9.80665f;  // m/s^2, standard
constexpr float kDegree = kPi / 180.0f;

struct Vec3 {
  float x, y, z;
};

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(const Vec3& a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline float clamp(float value, float low, float high) { return value < low ? low : (value > high ? high : value); }

// Moves `value` towards `target` by at most `step`.
inline float slew(float value, float target, float step) { return value + clamp(target - value, -step, step); }

// The same angle in (-pi, pi]; meant for angles within a few turns.
inline float wrap_pi(float angle) {
  while (angle > kPi) angle -= 2.0f * kPi;
  while (angle <= -kPi) angle += 2.0f * kPi;
  return angle;
}

// Attitude of the body (FRD) in the mission frame (NED), Hamilton convention.
struct Quaternion {
  float w, x, y, z;
};

}  // namespace shoal
