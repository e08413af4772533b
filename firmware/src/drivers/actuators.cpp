// Limits of range and rate, and the conversion of fin angle and throttle to pulse widths.
#ifdef __AVR__
#pragma GCC optimize("O2")  // runs in every tick
#endif

#include "actuators.h"

#include "../control/maths.h"

namespace shoal {
namespace {

constexpr float kNeutral = 1500.0f;                        // us
constexpr float kServoScale = 500.0f / (60.0f * kDegree);  // us per rad
constexpr float kEscScale = 400.0f;                        // us per full throttle

// A value that is not a number must never reach a pin.
float finite_or_zero(float value) { return isfinite(value) ? value : 0.0f; }

}  // namespace

void Actuators::step(const Outputs& target, const Parameters& parameters, float dt) {
  const float limit = parameters.get(Parameter::FIN_LIMIT) * kDegree;
  const float fin_step = parameters.get(Parameter::FIN_RATE) * kDegree * dt;
  const float throttle_limit = parameters.get(Parameter::THR_MAX);
  const float throttle_step = parameters.get(Parameter::THR_RATE) * dt;
  outputs_.bow = slew(outputs_.bow, clamp(finite_or_zero(target.bow), -limit, limit), fin_step);
  outputs_.stern = slew(outputs_.stern, clamp(finite_or_zero(target.stern), -limit, limit), fin_step);
  outputs_.throttle =
      slew(outputs_.throttle, clamp(finite_or_zero(target.throttle), -throttle_limit, throttle_limit), throttle_step);
  write(Actuator::bow, (outputs_.bow + parameters.get(Parameter::BOW_TRIM) * kDegree) * kServoScale);
  write(Actuator::stern, (outputs_.stern + parameters.get(Parameter::STERN_TRIM) * kDegree) * kServoScale);
  write(Actuator::motor, outputs_.throttle * kEscScale);
}

void Actuators::neutral() {
  outputs_ = {};
  write(Actuator::bow, 0.0f);
  write(Actuator::stern, 0.0f);
  write(Actuator::motor, 0.0f);
}

void Actuators::write(Actuator actuator, float offset_us) {
  const float range = actuator == Actuator::motor ? 400.0f : 500.0f;
  const uint16_t width = static_cast<uint16_t>(kNeutral + clamp(offset_us, -range, range) + 0.5f);
  pulses_[static_cast<uint8_t>(actuator)] = width;
  board_.write_pulse_us(actuator, width);
}

}  // namespace shoal
