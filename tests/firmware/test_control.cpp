// Estimators and loops by themselves: convergence, gates, signs and limits.
#include <doctest/doctest.h>

#include "firmware/src/control/attitude.h"
#include "firmware/src/control/autopilot.h"
#include "firmware/src/control/mixer.h"
#include "firmware/src/control/speed.h"
#include "firmware/src/control/vertical.h"

using namespace shoal;

namespace {

const Vec3 kField = {20.0f, 0.0f, 43.0f};  // uT, mission frame; declination 0

// Turns a vector of the mission frame into the body frame.
Vec3 to_body(const Vec3& v, float roll, float pitch, float yaw) {
  const Vec3 a = {v.x * cosf(yaw) + v.y * sinf(yaw), -v.x * sinf(yaw) + v.y * cosf(yaw), v.z};
  const Vec3 b = {a.x * cosf(pitch) - a.z * sinf(pitch), a.y, a.x * sinf(pitch) + a.z * cosf(pitch)};
  return {b.x, b.y * cosf(roll) + b.z * sinf(roll), -b.y * sinf(roll) + b.z * cosf(roll)};
}

ImuSample sample_at(float roll, float pitch, float yaw) {
  ImuSample s = {};
  s.specific_force = to_body({0.0f, 0.0f, -kGravity}, roll, pitch, yaw);
  s.field = to_body(kField, roll, pitch, yaw);
  s.field_valid = true;
  return s;
}

void feed(AttitudeEstimator& attitude, ImuSample sample, const Parameters& parameters, float seconds,
          float speed = 0.0f) {
  for (int i = 0; i < static_cast<int>(seconds * 100.0f); ++i) {
    sample.field_read = i % 2 == 0;
    attitude.step(sample, speed, parameters, 0.01f);
  }
}

float angle_between(float a, float b) { return fabsf(wrap_pi(a - b)); }

Navigation level_at(float depth, float yaw, float speed) { return {0.0f, yaw, {0, 0, 0}, depth, 0.0f, speed, 0.8f}; }

}  // namespace

TEST_CASE("the attitude settles from any attitude within three seconds, to a tenth of a degree") {
  Parameters parameters;
  for (float roll = -3.0f; roll < 3.1f; roll += 1.5f) {
    for (float pitch = -1.4f; pitch < 1.5f; pitch += 0.7f) {
      for (float yaw = -3.1f; yaw < 3.2f; yaw += 0.9f) {
        AttitudeEstimator attitude;
        feed(attitude, sample_at(roll, pitch, yaw), parameters, 3.0f);
        CAPTURE(roll);
        CAPTURE(pitch);
        CAPTURE(yaw);
        CHECK(attitude.settled());
        CHECK(angle_between(attitude.roll(), roll) < 0.002f);
        CHECK(angle_between(attitude.pitch(), pitch) < 0.002f);
        CHECK(angle_between(attitude.yaw(), yaw) < 0.002f);
      }
    }
  }
}

TEST_CASE("the declination turns magnetic into true north") {
  Parameters parameters;
  REQUIRE(parameters.set(Parameters::find("MAG_DECL"), 10.0f) == SetResult::accepted);
  AttitudeEstimator attitude;
  feed(attitude, sample_at(0.0f, 0.0f, 3.1f), parameters, 3.0f);
  CHECK(angle_between(attitude.yaw(), 3.1f + 10.0f * kDegree) < 0.002f);
}

TEST_CASE("a gyroscope's bias is found and taken off") {
  Parameters parameters;
  AttitudeEstimator attitude;
  ImuSample s = sample_at(0.1f, -0.1f, 1.0f);
  s.rate = {0.02f, -0.03f, 0.04f};
  feed(attitude, s, parameters, 300.0f);
  CHECK(fabsf(attitude.rate().x) < 0.002f);
  CHECK(fabsf(attitude.rate().y) < 0.002f);
  CHECK(fabsf(attitude.rate().z) < 0.002f);
  CHECK(angle_between(attitude.yaw(), 1.0f) < 0.005f);
}

TEST_CASE("a turn at speed does not tilt the horizon") {
  Parameters parameters;
  AttitudeEstimator attitude;
  feed(attitude, sample_at(0.0f, 0.0f, 0.0f), parameters, 3.0f);
  float yaw = 0.0f;
  for (int i = 0; i < 3000; ++i) {
    yaw += 0.4f * 0.01f;
    ImuSample s = sample_at(0.0f, 0.0f, yaw);
    s.rate = {0.0f, 0.0f, 0.4f};
    s.specific_force.y += 0.4f * 0.6f;  // centripetal
    s.field_read = i % 2 == 0;
    attitude.step(s, 0.6f, parameters, 0.01f);
  }
  CHECK(fabsf(attitude.roll()) < 0.005f);
  CHECK(angle_between(attitude.yaw(), wrap_pi(yaw - 6.0f * kPi)) < 0.02f);
}

TEST_CASE("half a g from the side and a magnet beside the compass move nothing: both are gated") {
  Parameters parameters;
  AttitudeEstimator attitude;
  feed(attitude, sample_at(0.0f, 0.0f, 0.5f), parameters, 10.0f);
  ImuSample s = sample_at(0.0f, 0.0f, 0.5f);
  s.specific_force.y += 0.5f * kGravity;
  s.field = s.field + Vec3{30.0f, 80.0f, 0.0f};
  feed(attitude, s, parameters, 5.0f);
  CHECK(fabsf(attitude.roll()) < 0.01f);
  CHECK(angle_between(attitude.yaw(), 0.5f) < 0.01f);
}

TEST_CASE("depth and vertical speed follow a steady dive without lag") {
  Parameters parameters;
  DepthEstimator depth;
  const float rho_g = parameters.get(Parameter::WATER_RHO) * kGravity;
  for (int i = 0; i < 1000; ++i) {
    const float truth = 1.0f + 0.1f * 0.02f * static_cast<float>(i);
    depth.predict(0.02f);
    if (i % 5 != 0)
      depth.correct(parameters.get(Parameter::SURF_PA) + truth * rho_g, parameters, i % 5 == 1 ? 0.04f : 0.02f);
  }
  CHECK(depth.depth() == doctest::Approx(1.0 + 0.1 * 0.02 * 999).epsilon(0.002));
  CHECK(depth.descent() == doctest::Approx(0.1).epsilon(0.02));
}

TEST_CASE("the speed model settles where throttle and battery say, and coasts") {
  Parameters parameters;
  SpeedModel model;
  model.set_battery(11.1f, parameters);
  for (int i = 0; i < 3000; ++i) model.step(1.0f, 0.02f);
  CHECK(model.speed() == doctest::Approx(parameters.get(Parameter::SPD_FULL)).epsilon(0.001));
  model.set_battery(5.56f, parameters);
  for (int i = 0; i < 3000; ++i) model.step(1.0f, 0.02f);
  CHECK(model.speed() == doctest::Approx(0.5 * parameters.get(Parameter::SPD_FULL)).epsilon(0.01));
  model.set_battery(0.0f, parameters);
  CHECK(model.full_speed() == parameters.get(Parameter::SPD_FULL));
  for (int i = 0; i < 500; ++i) model.step(0.0f, 0.02f);
  CHECK(model.speed() > 0.0f);
  CHECK(model.speed() < 0.2f);
  for (int i = 0; i < 3000; ++i) model.step(-1.0f, 0.02f);
  CHECK(model.speed() < 0.0f);
}

TEST_CASE("commands have the right sign: starboard for a heading to starboard, bow down to go deeper") {
  Parameters parameters;
  Autopilot pilot;
  Effort effort = pilot.step(level_at(2.0f, 3.0f, 0.5f), {-3.0f, 3.0f, 0.5f}, parameters, 0.02f);
  CHECK(effort.rudder > 0.0f);  // across the wrap, starboard is the short way
  CHECK(effort.plane < 0.0f);
  CHECK(effort.throttle > 0.5f);
  pilot.reset();
  effort = pilot.step(level_at(2.0f, 0.0f, 0.5f), {-0.5f, 1.0f, 0.0f}, parameters, 0.02f);
  CHECK(effort.rudder < 0.0f);
  CHECK(effort.plane > 0.0f);
  CHECK(effort.throttle == 0.0f);
}

TEST_CASE("integrals stop at the limits: after a minute against them the command turns within a second") {
  Parameters parameters;
  Autopilot pilot;
  const float limit = parameters.get(Parameter::FIN_LIMIT) * kDegree;
  for (int i = 0; i < 3000; ++i) {
    const Effort e = pilot.step(level_at(2.0f, 0.0f, 0.4f), {2.0f, 9.0f, 0.4f}, parameters, 0.02f);
    CHECK(fabsf(e.rudder) <= limit);
    CHECK(fabsf(e.plane) <= limit);
  }
  Effort e = {};
  for (int i = 0; i < 50; ++i) e = pilot.step(level_at(9.5f, 2.5f, 0.4f), {2.0f, 9.0f, 0.4f}, parameters, 0.02f);
  CHECK(e.rudder < 0.0f);
  CHECK(e.plane > 0.0f);
}

TEST_CASE("fins deflect more at low speed, but no more below steerage way") {
  Parameters parameters;
  const auto plane_at = [&](float speed) {
    Autopilot pilot;
    Navigation now = level_at(2.0f, 0.0f, speed);
    now.pitch = 0.02f;
    return -pilot.step(now, {0.0f, 2.0f, speed}, parameters, 0.02f).plane;
  };
  CHECK(plane_at(0.25f) == doctest::Approx(4.0 * plane_at(0.5f)).epsilon(0.02));
  CHECK(plane_at(0.05f) == doctest::Approx(plane_at(0.2f)).epsilon(0.02));
}

TEST_CASE("the mixer is a matter of parameters") {
  Parameters parameters;
  Outputs out = mix({0.3f, -0.2f, 0.5f}, parameters);
  CHECK(out.stern == doctest::Approx(0.3));
  CHECK(out.bow == doctest::Approx(-0.2));
  REQUIRE(parameters.set(Parameters::find("BOW_YAW"), -0.5f) == SetResult::accepted);
  out = mix({0.3f, -0.2f, 0.5f}, parameters);
  CHECK(out.bow == doctest::Approx(-0.35));
}
