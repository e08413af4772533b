// The failsafe table, its debouncing and hysteresis, and the arming state machine.
#include "safety.h"

#include "../flash.h"

namespace shoal {
namespace {

// MAV_SEVERITY
constexpr uint8_t kCritical = 2, kWarning = 4;

// Which action a row takes: its own, or the one that parameter FS_ACTION names.
constexpr uint8_t kByParameter = 0xFF;
constexpr uint8_t own(Action action) { return static_cast<uint8_t>(action); }

struct Rule {
  uint16_t set_ms;    // the condition holds this long before the cause sets
  uint16_t clear_ms;  // and is gone this long before it clears
  uint8_t action;
  bool only_armed;  // the condition means something only while armed
  bool refuses;     // refuses arming
};

struct Row {
  Rule rule;
  uint8_t severity;
  char text[kCauseTextLength];
};

const Row kRows[kCauseCount] PROGMEM = {
    // set   clear  action                 armed  refuse severity   text
    {{300, 1000, own(Action::stop), false, true}, kCritical, "IMU silent"},
    {{0, 1000, own(Action::stop), false, true}, kCritical, "IMU frozen"},
    {{3000, 0, own(Action::none), false, true}, kWarning, "attitude not settled"},
    {{1000, 1000, own(Action::surface), false, true}, kCritical, "depth sensor silent"},
    {{2000, 2000, own(Action::none), false, true}, kWarning, "battery low"},
    {{2000, 2000, own(Action::surface), false, true}, kCritical, "battery critical"},
    {{300, 5000, own(Action::surface), false, true}, kCritical, "leak"},
    {{500, 1000, own(Action::surface), false, true}, kCritical, "deeper than DEPTH_MAX"},
    {{0, 0, own(Action::hold), true, false}, kWarning, "setpoint stale"},
    {{0, 0, kByParameter, true, false}, kCritical, "setpoint lost"},
    {{0, 0, kByParameter, false, true}, kCritical, "companion's heartbeat lost"},
};

constexpr float kVoltageHysteresis = 0.3f;  // V
constexpr float kDepthMargin = 0.5f;        // m below DEPTH_MAX

uint16_t milliseconds(float seconds) { return static_cast<uint16_t>(seconds * 1000.0f); }

uint16_t add_saturated(uint16_t value, uint16_t step) {
  return value > 0xFFFF - step ? 0xFFFF : static_cast<uint16_t>(value + step);
}

}  // namespace

// Whether the condition of a cause holds at this moment; a cause that is active clears only past its hysteresis.
bool Safety::holds(Cause cause, bool was, const Health& health, const Parameters& parameters) const {
  const float more_volts = was ? kVoltageHysteresis : 0.0f;
  // A vehicle that was just armed has the full time to receive its first setpoint.
  const uint16_t setpoint_age = health.setpoint_age_ms < armed_ms_ ? health.setpoint_age_ms : armed_ms_;
  switch (cause) {
    case Cause::imu_silent:
      return health.imu == ImuState::silent || health.imu == ImuState::starting;
    case Cause::imu_frozen:
      return health.imu == ImuState::frozen;
    case Cause::attitude_unsettled:
      return !health.attitude_settled;
    case Cause::depth_silent:
      return !health.depth_running;
    case Cause::battery_low:
      return health.battery_v < parameters.get(Parameter::BAT_LOW_V) + more_volts;
    case Cause::battery_critical:
      return health.battery_v < parameters.get(Parameter::BAT_CRIT_V) + more_volts;
    case Cause::leak:
      return health.leak;
    case Cause::too_deep:
      return health.depth_running && health.depth > parameters.get(Parameter::DEPTH_MAX) + (was ? 0.0f : kDepthMargin);
    case Cause::setpoint_stale:
      return setpoint_age > milliseconds(parameters.get(Parameter::FS_HOLD_S));
    case Cause::setpoint_lost:
      return setpoint_age > milliseconds(parameters.get(Parameter::FS_LOST_S));
    case Cause::companion_lost:
      return health.heartbeat_age_ms > milliseconds(parameters.get(Parameter::FS_BEAT_S));
    case Cause::count:
      break;
  }
  return false;
}

void Safety::step(const Health& health, const Parameters& parameters, uint16_t dt_ms) {
  const bool driving_now = driving();
  if (driving_now) armed_ms_ = add_saturated(armed_ms_, dt_ms);
  recoverable_ = Action::none;
  CauseSet present = 0;
  CauseSet mask = 1;
  for (uint8_t i = 0; i < kCauseCount; ++i, mask <<= 1) {
    const Rule rule = read_flash(kRows[i].rule);
    const bool active = (active_ & mask) != 0;
    const bool holding = (driving_now || !rule.only_armed) && holds(static_cast<Cause>(i), active, health, parameters);
    if (holding) present |= mask;
    if (holding == active) {
      since_ms_[i] = 0;
    } else if (since_ms_[i] >= (holding ? rule.set_ms : rule.clear_ms)) {
      active_ ^= mask;
      since_ms_[i] = 0;
    } else {
      since_ms_[i] = add_saturated(since_ms_[i], dt_ms);
    }
    if (!(active_ & mask) || !driving_now) continue;

    const bool stops = parameters.get(Parameter::FS_ACTION) >= 1.5f;
    const Action action = rule.action != kByParameter ? static_cast<Action>(rule.action)
                          : stops                     ? Action::stop
                                                      : Action::surface;
    if (action >= Action::surface) {
      mode_ = Mode::failsafe;
      if (action > latched_) latched_ = action;
    } else if (action > recoverable_) {
      recoverable_ = action;
    }
  }
  present_ = present;
}

Action Safety::action() const {
  if (mode_ == Mode::failsafe) return latched_;
  return mode_ == Mode::armed ? recoverable_ : Action::none;
}

CauseSet Safety::refusals() const {
  CauseSet refusing = 0;
  for (uint8_t i = 0; i < kCauseCount; ++i) {
    if (read_flash(kRows[i].rule.refuses)) refusing |= bit_of(static_cast<Cause>(i));
  }
  return refusing & (present_ | active_);
}

bool Safety::arm() {
  if (mode_ == Mode::terminated || refusals() != 0) return false;
  if (mode_ != Mode::armed) armed_ms_ = 0;
  mode_ = Mode::armed;
  latched_ = Action::none;
  active_ &= static_cast<CauseSet>(~(bit_of(Cause::setpoint_stale) | bit_of(Cause::setpoint_lost)));
  return true;
}

void Safety::disarm() {
  if (mode_ == Mode::terminated) return;
  mode_ = Mode::disarmed;
  latched_ = Action::none;
}

uint8_t Safety::describe(Cause cause, char text[kCauseTextLength]) {
  const Row row = read_flash(kRows[static_cast<uint8_t>(cause)]);
  memcpy(text, row.text, kCauseTextLength);
  return row.severity;
}

}  // namespace shoal
