// A board for unit tests: the register-level chips of the simulator behind it, everything else plain memory.
#pragma once

#include <stdint.h>
#include <string.h>

#include <deque>
#include <vector>

#include "firmware/src/board.h"
#include "firmware/src/pins.h"

extern "C" {
#include "sim/mcu/chips/icm20948.h"
#include "sim/mcu/chips/ms5837.h"
}

namespace shoal {

class FakeBoard final : public Board {
 public:
  mcu_readings readings = {{0, 0, -9.80665}, {0, 0, 0}, {20, 0, 43}, 25, 101325, 15, 11.1, 2, 0};
  icm20948 imu = {};
  ms5837 depth = {};
  bool imu_silent = false;
  bool depth_silent = false;
  bool prom_damaged = false;
  bool noisy = true;  // a live sensor never repeats itself
  uint16_t pulses[3] = {};
  std::vector<uint8_t> sent;
  std::deque<uint8_t> arriving;
  bool transmit_full = false;
  uint8_t eeprom[4096];
  unsigned eeprom_writes = 0;
  int transfers = 0;  // on either bus, since last set to 0
  bool rebooted = false;
  ResetCause cause = ResetCause::power_on;

  FakeBoard() {
    memset(eeprom, 0xFF, sizeof eeprom);
    icm20948_power_on(&imu, 0);
    ms5837_power_on(&depth, 0);
    advance_ms(65);
  }

  void advance_ms(unsigned ms) {
    for (unsigned i = 0; i < ms; ++i) {
      now_ns_ += 1000000;
      mcu_readings now = readings;
      for (int axis = 0; axis < 3 && noisy; ++axis) {
        now.specific_force_mps2[axis] += 0.02 * draw();
        now.rate_rps[axis] += 0.002 * draw();
        now.field_ut[axis] += 0.4 * draw();
      }
      icm20948_run_until(&imu, &now, now_ns_);
      ms5837_run_until(&depth, &now, now_ns_);
    }
  }

  uint32_t micros() override { return static_cast<uint32_t>(now_ns_ / 1000); }

  void imu_transfer(uint8_t* bytes, uint8_t count) override {
    ++transfers;
    icm20948_select(&imu, true);
    for (uint8_t i = 0; i < count; ++i) bytes[i] = imu_silent ? 0xFF : icm20948_exchange(&imu, bytes[i], now_ns_);
    icm20948_select(&imu, false);
  }

  bool i2c_write(uint8_t address, const uint8_t* bytes, uint8_t count) override {
    if (!answers(address)) return false;
    for (uint8_t i = 0; i < count; ++i) ms5837_write(&depth, bytes[i], now_ns_);
    return true;
  }
  bool i2c_read(uint8_t address, uint8_t* bytes, uint8_t count) override {
    if (!answers(address)) return false;
    for (uint8_t i = 0; i < count; ++i) bytes[i] = ms5837_read(&depth);
    if (prom_damaged && count == 2) bytes[1] ^= 0x04;
    return true;
  }

  void write_pulse_us(Actuator actuator, uint16_t width_us) override { pulses[static_cast<int>(actuator)] = width_us; }
  uint16_t read_analog(Analog input) override {
    const double volts = input == Analog::battery_voltage ? readings.battery_v / SHOAL_BATTERY_VOLTS_PER_VOLT
                                                          : readings.battery_a / SHOAL_BATTERY_AMPS_PER_VOLT;
    return static_cast<uint16_t>(volts / 5 * 1023);
  }
  bool leak_detected() override { return readings.leak != 0; }
  void write_led(bool) override {}

  uint8_t read_bytes(Port port, uint8_t* bytes, uint8_t capacity) override {
    uint8_t count = 0;
    for (; port == Port::companion && count < capacity && !arriving.empty(); arriving.pop_front())
      bytes[count++] = arriving.front();
    return count;
  }
  bool write_bytes(Port port, const uint8_t* bytes, uint16_t count) override {
    if (transmit_full) return false;
    if (port == Port::companion) sent.insert(sent.end(), bytes, bytes + count);
    return true;
  }
  uint16_t receive_overruns(Port) override { return 0; }

  uint8_t eeprom_read(uint16_t address) override { return eeprom[address]; }
  bool eeprom_ready() override { return now_ns_ >= eeprom_ready_ns_; }
  bool eeprom_write(uint16_t address, uint8_t value) override {
    if (!eeprom_ready()) return false;
    eeprom[address] = value;
    eeprom_ready_ns_ = now_ns_ + 3400000;
    ++eeprom_writes;
    return true;
  }

  ResetCause reset_cause() override { return cause; }
  void feed_watchdog() override {}
  void reboot() override { rebooted = true; }
  uint16_t free_ram() override { return 4000; }

 private:
  bool answers(uint8_t address) {
    ++transfers;
    return !depth_silent && address == MS5837_ADDRESS && ms5837_start(&depth, now_ns_);
  }
  // Uniform in -1 to 1, the same in every run.
  double draw() {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<double>(state_ >> 33) / 1073741824.0 - 1.0;
  }

  uint64_t now_ns_ = 0;
  uint64_t eeprom_ready_ns_ = 0;
  uint64_t state_ = 1;
};

}  // namespace shoal
