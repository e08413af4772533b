// The failsafe table row by row, the arming states, and the parameters in EEPROM.
#include <doctest/doctest.h>

#include <functional>

#include "fake_board.h"
#include "firmware/src/params/parameters.h"
#include "firmware/src/safety/safety.h"

using namespace shoal;

namespace {

const Health kHealthy = {ImuState::running, true, true, 2.0f, 11.1f, false, 0, 0};

// Steps until the cause is active (or not); returns the time in ms, or -1 after 20 s.
int ms_until(Safety& safety, const Health& health, const Parameters& parameters, Cause cause, bool active) {
  for (int ms = 0; ms <= 20000; ms += 10) {
    safety.step(health, parameters, 10);
    if (((safety.active() & bit_of(cause)) != 0) == active) return ms;
  }
  return -1;
}

Safety armed(const Parameters& parameters) {
  Safety safety;
  safety.step(kHealthy, parameters, 10);
  REQUIRE(safety.arm());
  safety.step(kHealthy, parameters, 10);
  return safety;
}

struct Injection {
  Cause cause;
  std::function<void(Health&)> break_it;
  int set_ms, clear_ms;
  Mode mode;
  Action action;
  bool refuses;
};

const Injection kInjections[] = {
    {Cause::imu_silent, [](Health& h) { h.imu = ImuState::silent; }, 300, 1000, Mode::failsafe, Action::stop, true},
    {Cause::imu_frozen, [](Health& h) { h.imu = ImuState::frozen; }, 0, 1000, Mode::failsafe, Action::stop, true},
    {Cause::attitude_unsettled, [](Health& h) { h.attitude_settled = false; }, 3000, 0, Mode::armed, Action::none,
     true},
    {Cause::depth_silent, [](Health& h) { h.depth_running = false; }, 1000, 1000, Mode::failsafe, Action::surface,
     true},
    {Cause::battery_low, [](Health& h) { h.battery_v = 10.0f; }, 2000, 2000, Mode::armed, Action::none, true},
    {Cause::battery_critical, [](Health& h) { h.battery_v = 9.0f; }, 2000, 2000, Mode::failsafe, Action::surface, true},
    {Cause::leak, [](Health& h) { h.leak = true; }, 300, 5000, Mode::failsafe, Action::surface, true},
    {Cause::too_deep, [](Health& h) { h.depth = 10.6f; }, 500, 1000, Mode::failsafe, Action::surface, true},
    {Cause::setpoint_stale, [](Health& h) { h.setpoint_age_ms = 501; }, 0, 0, Mode::armed, Action::hold, false},
    {Cause::setpoint_lost, [](Health& h) { h.setpoint_age_ms = 2001; }, 0, 0, Mode::failsafe, Action::surface, false},
    {Cause::companion_lost, [](Health& h) { h.heartbeat_age_ms = 5001; }, 0, 0, Mode::failsafe, Action::surface, true},
};

}  // namespace

TEST_CASE("every failsafe row sets, acts, clears and refuses as its table says") {
  Parameters parameters;
  static_assert(sizeof kInjections / sizeof kInjections[0] == kCauseCount, "one injection a row");
  for (const Injection& injection : kInjections) {
    char text[kCauseTextLength];
    Safety::describe(injection.cause, text);
    CAPTURE(text);
    Safety safety = armed(parameters);
    // Long enough armed that an old setpoint is not forgiven as history.
    for (int i = 0; i < 300; ++i) safety.step(kHealthy, parameters, 10);
    Health broken = kHealthy;
    injection.break_it(broken);
    CHECK(ms_until(safety, broken, parameters, injection.cause, true) == injection.set_ms);
    CHECK(safety.mode() == injection.mode);
    CHECK(safety.action() == injection.action);
    CHECK(((safety.refusals() & bit_of(injection.cause)) != 0) == injection.refuses);
    CHECK(ms_until(safety, kHealthy, parameters, injection.cause, false) == injection.clear_ms);
    // What drove the vehicle into a failsafe stays in force until it is armed again; the rest is over.
    CHECK(safety.mode() == injection.mode);
    CHECK(safety.action() == (injection.mode == Mode::failsafe ? injection.action : Action::none));
    for (int i = 0; i < 1000; ++i) safety.step(kHealthy, parameters, 10);
    CHECK(safety.arm());
    CHECK(safety.mode() == Mode::armed);
    CHECK(safety.action() == Action::none);
  }
}

TEST_CASE("while a condition holds, even before its row sets, arming is refused and all reasons are known") {
  Parameters parameters;
  Safety safety;
  Health broken = kHealthy;
  broken.imu = ImuState::starting;
  broken.leak = true;
  broken.battery_v = 9.0f;
  safety.step(broken, parameters, 10);
  CHECK_FALSE(safety.arm());
  CHECK(safety.mode() == Mode::disarmed);
  CHECK(safety.refusals() == (bit_of(Cause::imu_silent) | bit_of(Cause::leak) | bit_of(Cause::battery_low) |
                              bit_of(Cause::battery_critical)));
  safety.step(kHealthy, parameters, 10);
  CHECK(safety.arm());
}

TEST_CASE("nothing acts on a disarmed vehicle, and the graver action wins") {
  Parameters parameters;
  Safety safety;
  Health broken = kHealthy;
  broken.leak = true;
  for (int i = 0; i < 200; ++i) safety.step(broken, parameters, 10);
  CHECK(safety.mode() == Mode::disarmed);
  CHECK(safety.action() == Action::none);

  safety = armed(parameters);
  for (int i = 0; i < 100; ++i) safety.step(broken, parameters, 10);
  CHECK(safety.action() == Action::surface);
  broken.imu = ImuState::silent;
  for (int i = 0; i < 100; ++i) safety.step(broken, parameters, 10);
  CHECK(safety.action() == Action::stop);
}

TEST_CASE("a vehicle has the full time to its first setpoint; stop instead of surface is a parameter") {
  Parameters parameters;
  REQUIRE(parameters.set(Parameters::find("FS_ACTION"), 2.0f) == SetResult::accepted);
  Health silent = kHealthy;
  silent.setpoint_age_ms = 0xFFFF;
  Safety safety = armed(parameters);
  const int stale = ms_until(safety, silent, parameters, Cause::setpoint_stale, true);
  CHECK(stale >= 480);
  CHECK(stale <= 520);
  const int lost = stale + ms_until(safety, silent, parameters, Cause::setpoint_lost, true);
  CHECK(lost >= 1980);
  CHECK(lost <= 2020);
  CHECK(safety.action() == Action::stop);
}

TEST_CASE("a voltage at the threshold does not flutter: clearing takes 0.3 V more") {
  Parameters parameters;
  Safety safety;
  Health low = kHealthy;
  low.battery_v = 10.1f;
  CHECK(ms_until(safety, low, parameters, Cause::battery_low, true) == 2000);
  low.battery_v = 10.4f;
  CHECK(ms_until(safety, low, parameters, Cause::battery_low, false) == -1);
  low.battery_v = 10.6f;
  CHECK(ms_until(safety, low, parameters, Cause::battery_low, false) == 2000);
}

TEST_CASE("termination is final") {
  Parameters parameters;
  Safety safety = armed(parameters);
  safety.terminate();
  CHECK_FALSE(safety.arm());
  safety.disarm();
  CHECK(safety.mode() == Mode::terminated);
  CHECK_FALSE(safety.driving());
}

TEST_CASE("parameters hold to their ranges and are found by name") {
  Parameters parameters;
  const uint8_t limit = Parameters::find("FIN_LIMIT");
  REQUIRE(limit == static_cast<uint8_t>(Parameter::FIN_LIMIT));
  CHECK(parameters.set(limit, 25.0f) == SetResult::accepted);
  CHECK(parameters.set(limit, 61.0f) == SetResult::out_of_range);
  CHECK(parameters.set(limit, NAN) == SetResult::out_of_range);
  CHECK(parameters.set(limit, -INFINITY) == SetResult::out_of_range);
  CHECK(parameters.get(Parameter::FIN_LIMIT) == 25.0f);
  CHECK(Parameters::find("FIN_LIMI") == kParameterCount);
  CHECK(Parameters::find("FIN_LIMIT_") == kParameterCount);
  CHECK(parameters.set(kParameterCount, 1.0f) == SetResult::unknown);
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    char name[kParameterNameLength + 1] = {};
    Parameters::copy_name(i, name);
    CHECK(Parameters::find(name) == i);
    CHECK(parameters.set(i, Parameters().at(i)) == SetResult::accepted);  // the default is in range
  }
}

TEST_CASE("a changed parameter survives a restart, one byte a tick, unchanged bytes unwritten") {
  FakeBoard board;
  Parameters parameters;
  CHECK_FALSE(parameters.load(board));  // an erased EEPROM
  parameters.set(Parameters::find("HDG_P"), 0.75f);
  int ticks = 0;
  for (; parameters.storing(); ++ticks) {
    const unsigned before = board.eeprom_writes;
    parameters.store_step(board);
    CHECK(board.eeprom_writes - before <= 1);
    board.advance_ms(10);
  }
  CHECK(ticks <= 4 * kParameterCount + 4);
  Parameters again;
  CHECK(again.load(board));
  CHECK(again.get(Parameter::HDG_P) == 0.75f);

  const unsigned before = board.eeprom_writes;
  again.set(Parameters::find("HDG_P"), 0.8f);
  while (again.storing()) {
    again.store_step(board);
    board.advance_ms(10);
  }
  CHECK(board.eeprom_writes - before <= 6);  // value and CRC
}

TEST_CASE("a copy that is damaged in any byte is not taken, and the defaults stand") {
  FakeBoard board;
  Parameters parameters;
  parameters.set(Parameters::find("HDG_P"), 0.75f);
  while (parameters.storing()) {
    parameters.store_step(board);
    board.advance_ms(10);
  }
  for (unsigned at = 0; at < 4U * kParameterCount + 4; ++at) {
    board.eeprom[at] ^= 0x10;
    Parameters damaged;
    CHECK_FALSE(damaged.load(board));
    CHECK(damaged.get(Parameter::HDG_P) == Parameters().get(Parameter::HDG_P));
    board.eeprom[at] ^= 0x10;
  }
}
