// Drivers against the register-level chips: start-up, readings, silence and return, limits of the outputs.
#include <doctest/doctest.h>

#include "fake_board.h"
#include "firmware/src/drivers/actuators.h"
#include "firmware/src/drivers/icm20948.h"
#include "firmware/src/drivers/ms5837.h"
#include "firmware/src/drivers/power.h"

using namespace shoal;

namespace {

// Ticks a driver for a time and returns after how many ticks the condition held, or -1.
template <typename Step, typename Condition>
int ticks_until(FakeBoard& board, int at_most, Step step, Condition condition) {
  for (int i = 1; i <= at_most; ++i) {
    board.advance_ms(10);
    step(i);
    if (condition()) return i;
  }
  return -1;
}

}  // namespace

TEST_CASE("the IMU starts within half a second and reads in the body frame") {
  FakeBoard board;
  Icm20948 imu(board);
  const double force[3] = {1.0, -2.0, -9.0}, rate[3] = {0.1, -0.2, 0.3}, field[3] = {18.0, -7.0, 41.0};
  for (int i = 0; i < 3; ++i) {
    board.readings.specific_force_mps2[i] = force[i];
    board.readings.rate_rps[i] = rate[i];
    board.readings.field_ut[i] = field[i];
  }
  const auto step = [&](int i) { imu.step(i % 2 == 0); };
  CHECK(ticks_until(board, 50, step, [&] { return imu.state() == ImuState::running; }) > 0);
  ticks_until(board, 50, step, [] { return false; });
  const ImuSample& s = imu.sample();
  CHECK(s.specific_force.x == doctest::Approx(1.0).epsilon(0.03));
  CHECK(s.specific_force.y == doctest::Approx(-2.0).epsilon(0.03));
  CHECK(s.specific_force.z == doctest::Approx(-9.0).epsilon(0.03));
  CHECK(s.rate.x == doctest::Approx(0.1).epsilon(0.03));
  CHECK(s.rate.y == doctest::Approx(-0.2).epsilon(0.03));
  CHECK(s.rate.z == doctest::Approx(0.3).epsilon(0.03));
  CHECK(s.field_valid);
  CHECK(s.field.x == doctest::Approx(18.0).epsilon(0.05));
  CHECK(s.field.y == doctest::Approx(-7.0).epsilon(0.08));
  CHECK(s.field.z == doctest::Approx(41.0).epsilon(0.05));
  CHECK(s.temperature_c == doctest::Approx(25.0).epsilon(0.02));
}

TEST_CASE("a silent IMU is reported at once, tried again, and used again when it answers") {
  FakeBoard board;
  Icm20948 imu(board);
  const auto step = [&](int i) { imu.step(i % 2 == 0); };
  REQUIRE(ticks_until(board, 50, step, [&] { return imu.state() == ImuState::running; }) > 0);
  board.imu_silent = true;
  CHECK(ticks_until(board, 3, step, [&] { return imu.state() == ImuState::silent; }) > 0);
  ticks_until(board, 200, step, [] { return false; });
  CHECK(imu.state() == ImuState::silent);
  board.imu_silent = false;
  CHECK(ticks_until(board, 80, step, [&] { return imu.state() == ImuState::running; }) > 0);
}

TEST_CASE("an IMU that repeats itself is frozen within a quarter of a second") {
  FakeBoard board;
  Icm20948 imu(board);
  const auto step = [&](int i) { imu.step(i % 2 == 0); };
  REQUIRE(ticks_until(board, 50, step, [&] { return imu.state() == ImuState::running; }) > 0);
  board.imu.frozen = true;
  CHECK(ticks_until(board, 25, step, [&] { return imu.state() == ImuState::frozen; }) > 0);
  board.imu.frozen = false;
  CHECK(ticks_until(board, 80, step, [&] { return imu.state() == ImuState::running; }) > 0);
}

TEST_CASE("a compass that repeats itself is not believed, the rest of the IMU is") {
  FakeBoard board;
  Icm20948 imu(board);
  const auto step = [&](int i) { imu.step(i % 2 == 0); };
  ticks_until(board, 60, step, [] { return false; });
  REQUIRE(imu.sample().field_valid);
  board.imu.compass.mode = 0;
  CHECK(ticks_until(board, 110, step, [&] { return !imu.sample().field_valid; }) > 90);
  CHECK(imu.state() == ImuState::running);
}

TEST_CASE("the depth sensor gives pressure and temperature over its whole range") {
  const double temperatures[] = {-18.0, -5.0, 10.0, 19.9, 20.1, 35.0};
  const double pressures[] = {50000.0, 101325.0, 300000.0, 2900000.0};
  for (double temperature : temperatures) {
    for (double pressure : pressures) {
      CAPTURE(temperature);
      CAPTURE(pressure);
      FakeBoard board;
      Ms5837 sensor(board);
      board.readings.pressure_pa = pressure;
      board.readings.water_temperature_c = temperature;
      int samples = 0;
      ticks_until(
          board, 100, [&](int i) { samples += i % 2 == 0 && sensor.step(); }, [] { return false; });
      CHECK(samples >= 25);
      CHECK(sensor.running());
      CHECK(sensor.pressure_pa() == doctest::Approx(pressure).epsilon(0.0005));
      CHECK(sensor.temperature_c() == doctest::Approx(temperature).scale(100).epsilon(0.0005));
    }
  }
}

TEST_CASE("no step of the depth sensor takes more than three short transfers") {
  FakeBoard board;
  Ms5837 sensor(board);
  for (int i = 0; i < 100; ++i) {
    board.advance_ms(20);
    board.transfers = 0;
    sensor.step();
    CHECK(board.transfers <= 3);
  }
}

TEST_CASE("a silent depth sensor stops running at once and comes back; a damaged PROM is never believed") {
  FakeBoard board;
  Ms5837 sensor(board);
  const auto step = [&](int i) { i % 2 == 0 && sensor.step(); };
  REQUIRE(ticks_until(board, 60, step, [&] { return sensor.running(); }) > 0);
  board.depth_silent = true;
  CHECK(ticks_until(board, 4, step, [&] { return !sensor.running(); }) > 0);
  board.depth_silent = false;
  CHECK(ticks_until(board, 100, step, [&] { return sensor.running(); }) > 0);

  FakeBoard damaged;
  damaged.prom_damaged = true;
  Ms5837 wrong(damaged);
  CHECK(ticks_until(
            damaged, 200, [&](int i) { i % 2 == 0 && wrong.step(); }, [&] { return wrong.running(); }) == -1);
  const uint16_t erased[7] = {};
  CHECK_FALSE(ms5837_prom_valid(erased));
}

TEST_CASE("outputs move no faster and no farther than the parameters allow, and never on a number that is none") {
  FakeBoard board;
  Parameters parameters;
  Actuators actuators(board);
  actuators.neutral();
  CHECK(board.pulses[0] == 1500);
  CHECK(board.pulses[2] == 1500);
  actuators.step({3.0f, -3.0f, 5.0f}, parameters, 0.02f);
  CHECK(board.pulses[0] == 1550);  // 300 deg/s for 20 ms are 6 deg are 50 us
  CHECK(board.pulses[1] == 1450);
  CHECK(board.pulses[2] == 1516);  // 2 a second for 20 ms are 4 % of 400 us
  for (int i = 0; i < 100; ++i) actuators.step({3.0f, -3.0f, 5.0f}, parameters, 0.02f);
  CHECK(board.pulses[0] == 1750);  // 30 deg
  CHECK(board.pulses[1] == 1250);
  CHECK(board.pulses[2] == 1900);
  for (int i = 0; i < 100; ++i) actuators.step({NAN, INFINITY, NAN}, parameters, 0.02f);
  CHECK(board.pulses[0] == 1500);
  CHECK(board.pulses[1] == 1500);
  CHECK(board.pulses[2] == 1500);
}

TEST_CASE("battery and leak come in volts, amperes and ampere hours") {
  FakeBoard board;
  Parameters parameters;
  Power power(board);
  board.readings.battery_v = 12.0;
  board.readings.battery_a = 3.6;
  for (int i = 0; i < 1000; ++i) power.step(0.1f);
  CHECK(power.voltage_v() == doctest::Approx(12.0).epsilon(0.002));
  CHECK(power.current_a() == doctest::Approx(3.6).epsilon(0.015));
  CHECK(power.used_ah() == doctest::Approx(0.1).epsilon(0.02));
  CHECK(power.remaining_percent(parameters) == doctest::Approx(98).epsilon(0.02));
  CHECK_FALSE(power.leak());
  board.readings.leak = 1;
  power.step(0.1f);
  CHECK(power.leak());
}
