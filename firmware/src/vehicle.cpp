// The tick on one screen: sense, estimate, guard, control, act, report.
#include "vehicle.h"

#include "control/mixer.h"

namespace shoal {
namespace {

constexpr uint16_t kLongestTickUs = 15000;  // more between two ticks means that one was missed
constexpr uint8_t kPowerTicks = 10;
constexpr uint16_t kForgetPressureMs = 1000;  // the depth estimate starts anew after such a gap
constexpr float kSurfaceSpeed = 0.4f;         // m/s
constexpr float kSurfaceDepth = 0.3f;         // m

uint16_t older(uint16_t age_ms, uint16_t step_ms) {
  return age_ms > 0xFFFF - step_ms ? 0xFFFF : static_cast<uint16_t>(age_ms + step_ms);
}

}  // namespace

void Vehicle::begin() {
  parts_.actuators.neutral();
  parts_.parameters.load(parts_.board);
  tick_started_us_ = parts_.board.micros();
}

// Servos take a new pulse every 20 ms only, so judging and steering share the ticks in turn.
void Vehicle::tick() {
  start_tick();
  sense();
  estimate();
  if (even()) {
    guard();
  } else {
    control();
    act();
  }
  report();
  end_tick();
}

void Vehicle::start_tick() {
  const uint32_t now = parts_.board.micros();
  const uint32_t elapsed = now - tick_started_us_;
  tick_started_us_ = now;
  parts_.now_us += elapsed;
  elapsed_ms_ = 0;
  for (spare_us_ += elapsed; spare_us_ >= 1000; spare_us_ -= 1000) ++elapsed_ms_;
  parts_.now_ms += elapsed_ms_;
  if (parts_.loop.ticks > 0 && elapsed > kLongestTickUs) parts_.loop.missed += (elapsed + 5000) / 10000 - 1;
  ++parts_.loop.ticks;
}

void Vehicle::sense() {
  new_imu_ = parts_.imu.step(!even());
  new_pressure_ = even() && parts_.depth_sensor.step();
  if (parts_.loop.ticks % kPowerTicks == 1) {
    parts_.power.step(kPowerTicks * kTick);
    parts_.speed.set_battery(parts_.power.voltage_v(), parts_.parameters);
  }
  parts_.companion.setpoint_age_ms = older(parts_.companion.setpoint_age_ms, elapsed_ms_);
  parts_.companion.heartbeat_age_ms = older(parts_.companion.heartbeat_age_ms, elapsed_ms_);
  link_.receive();
}

void Vehicle::estimate() {
  if (new_imu_) parts_.attitude.step(parts_.imu.sample(), parts_.speed.speed(), parts_.parameters, kTick);
  if (parts_.imu.state() != ImuState::running) parts_.attitude.reset();

  pressure_age_ms_ = older(pressure_age_ms_, elapsed_ms_);
  if (!even()) return;
  parts_.depth.predict(2.0f * kTick);
  if (!new_pressure_) return;
  if (pressure_age_ms_ > kForgetPressureMs) parts_.depth.reset();
  parts_.depth.correct(parts_.depth_sensor.pressure_pa(), parts_.parameters,
                       static_cast<float>(pressure_age_ms_) * 0.001f);
  pressure_age_ms_ = 0;
}

// Lets safety judge, and chooses what control works towards.
void Vehicle::guard() {
  Safety& safety = parts_.safety;
  const Companion& companion = parts_.companion;
  safety.step({parts_.imu.state(), parts_.attitude.settled(), parts_.depth_sensor.running(), parts_.depth.depth(),
               parts_.power.voltage_v(), parts_.power.leak(), companion.setpoint_age_ms, companion.heartbeat_age_ms},
              parts_.parameters, 2 * kTickMs);

  const bool just_armed = safety.driving() && !was_driving_;
  was_driving_ = safety.driving();
  const Setpoint here = {parts_.attitude.yaw(), parts_.depth.depth(), 0.0f};
  if (!was_driving_ || just_armed) parts_.target = here;
  if (!was_driving_) return;

  switch (safety.action()) {
    case Action::none:
      // A setpoint from before arming is history; the vehicle stays where it is until a new one comes.
      if (companion.setpoint_age_ms <= safety.armed_ms()) parts_.target = companion.setpoint;
      break;
    case Action::hold:
      parts_.target.speed = 0.0f;
      break;
    case Action::surface:
      parts_.target.depth = 0.0f;
      parts_.target.speed = parts_.depth.depth() > kSurfaceDepth ? kSurfaceSpeed : 0.0f;
      break;
    case Action::stop:
      parts_.target = here;
      break;
  }
}

void Vehicle::control() {
  parts_.speed.step(parts_.actuators.outputs().throttle, 2.0f * kTick);
  const Navigation now = {parts_.attitude.pitch(),  parts_.attitude.yaw(),  parts_.attitude.rate(),
                          parts_.depth.depth(),     parts_.depth.descent(), parts_.speed.speed(),
                          parts_.speed.full_speed()};
  effort_ = parts_.autopilot.step(now, parts_.target, parts_.parameters, 2.0f * kTick);
}

// Outputs move only while the vehicle drives, and steer only while the sensors that steering needs are alive.
void Vehicle::act() {
  const Safety& safety = parts_.safety;
  const bool blind = parts_.imu.state() != ImuState::running || !parts_.depth_sensor.running();
  const bool failed = safety.mode() == Mode::failsafe && (safety.action() == Action::stop || blind);
  if (!safety.driving() || failed) {
    parts_.actuators.neutral();
    parts_.autopilot.reset();
  } else {
    parts_.actuators.step(mix(effort_, parts_.parameters), parts_.parameters, 2.0f * kTick);
  }
}

void Vehicle::report() {
  link_.send();
  parts_.parameters.store_step(parts_.board);
  parts_.board.write_led(parts_.safety.driving() || (parts_.loop.ticks & 64) != 0);
  if (parts_.reboot_in_ms == 0) return;
  if (parts_.reboot_in_ms <= elapsed_ms_) parts_.board.reboot();
  parts_.reboot_in_ms -= parts_.reboot_in_ms > elapsed_ms_ ? elapsed_ms_ : 0;
}

void Vehicle::end_tick() {
  const uint32_t took = parts_.board.micros() - tick_started_us_;
  const uint16_t took_us = took > 0xFFFF ? 0xFFFF : static_cast<uint16_t>(took);
  LoopStatistics& loop = parts_.loop;
  if (took_us > loop.worst_us) loop.worst_us = took_us;
  mean_us_times_32_ += took_us - mean_us_times_32_ / 32;
  loop.mean_us = static_cast<uint16_t>(mean_us_times_32_ / 32);
  parts_.board.feed_watchdog();
}

}  // namespace shoal
