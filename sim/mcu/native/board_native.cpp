// The board's interface over the simulated chips.
#include "board_native.h"

#include <cmath>
#include <cstring>

namespace shoal_sim {
namespace {

constexpr uint64_t kSpiByteNs = 8 * 1000000000ull / 250000;
constexpr uint64_t kI2cBitNs = 1000000000ull / 200000;
constexpr uint64_t kI2cTimeoutNs = 1000000;
constexpr uint64_t kWatchdogNs = 128000000;  // 16384 cycles of 128 kHz, "120 ms"
constexpr uint64_t kRebootNs = 16000000;     // 2048 cycles, "15 ms"
constexpr double kReferenceV = 5;

double between(double low, double high, double x) { return x < low ? low : x > high ? high : x; }

}  // namespace

NativeBoard::NativeBoard(const mcu_config& config)
    : ports{{config.seed, 0, SHOAL_CONSOLE_BAUD, SHOAL_CONSOLE_BAUD, 128, 128},
            {config.seed, 1, config.baud ? config.baud : static_cast<uint32_t>(SHOAL_COMPANION_BAUD),
             SHOAL_COMPANION_BAUD, 256, 256}},
      imu_(),
      depth_(),
      random_(config.seed ^ 0xB05u) {
  if (config.eeprom) {
    std::memcpy(eeprom, config.eeprom, sizeof eeprom);
  } else {
    std::memset(eeprom, 0xFF, sizeof eeprom);
  }
}

void NativeBoard::power_on() {
  icm20948_power_on(&imu_, now_ns_);
  ms5837_power_on(&depth_, now_ns_);
}

void NativeBoard::cut_power() {
  if (change_.what != 0) {
    uint8_t& cell = eeprom[change_.address];
    cell = eeprom_cut(&change_, cell, now_ns_, line_random(&random_));
  }
  change_.what = 0;
}

void NativeBoard::reset(shoal::ResetCause cause) {
  started_ns_ = now_ns_;
  bites_ns_ = now_ns_ + kWatchdogNs;
  rebooting_ = false;
  cause_ = cause;
  for (Pulses& p : pulses) p.restart(now_ns_);
  for (SerialPort& p : ports) p.restart(now_ns_);
}

void NativeBoard::run_until(uint64_t now_ns) {
  if (now_ns > now_ns_) now_ns_ = now_ns;
  imu_.frozen = faults.imu_frozen != 0;
  icm20948_run_until(&imu_, &readings, now_ns_);
  ms5837_run_until(&depth_, &readings, now_ns_);
  ports[0].run_until(now_ns_, noise(shoal::Port::console), cut(shoal::Port::console), &counters);
  ports[1].run_until(now_ns_, noise(shoal::Port::companion), cut(shoal::Port::companion), &counters);
  if (change_.what != 0 && now_ns_ >= change_.begun_ns + eeprom_duration_ns(change_.what)) {
    eeprom[change_.address] = eeprom_done(&change_, eeprom[change_.address]);
    change_.what = 0;
  }
}

uint32_t NativeBoard::micros() { return static_cast<uint32_t>((now_ns_ - started_ns_) / 1000); }

void NativeBoard::imu_transfer(uint8_t* bytes, uint8_t count) {
  run_until(now_ns_);
  icm20948_select(&imu_, true);
  for (uint8_t i = 0; i < count; ++i) {
    now_ns_ += kSpiByteNs;
    bytes[i] = faults.imu_silent ? 0xFF : icm20948_exchange(&imu_, bytes[i], now_ns_);
  }
  icm20948_select(&imu_, false);
}

// Start, address and stop, and nine bits a byte; false when nobody answers or the bus is held.
bool NativeBoard::i2c_start(uint8_t address, unsigned bytes) {
  now_ns_ += faults.i2c_held ? kI2cTimeoutNs : kI2cBitNs * (2 + 9 * (1 + bytes));
  run_until(now_ns_);
  if (faults.i2c_held || faults.depth_silent || address != MS5837_ADDRESS) return false;
  return ms5837_start(&depth_, now_ns_);
}

bool NativeBoard::i2c_write(uint8_t address, const uint8_t* bytes, uint8_t count) {
  if (!i2c_start(address, count)) return false;
  for (uint8_t i = 0; i < count; ++i) ms5837_write(&depth_, bytes[i], now_ns_);
  return true;
}

bool NativeBoard::i2c_read(uint8_t address, uint8_t* bytes, uint8_t count) {
  if (!i2c_start(address, count)) return false;
  for (uint8_t i = 0; i < count; ++i) {
    const uint64_t draw = line_random(&random_);
    bytes[i] = ms5837_read(&depth_);
    if (static_cast<double>(draw >> 11) * 0x1p-53 < faults.i2c_bit_noise)
      bytes[i] ^= static_cast<uint8_t>(1u << (draw & 7));
  }
  return true;
}

void NativeBoard::write_pulse_us(shoal::Actuator actuator, uint16_t width_us) {
  pulses[static_cast<unsigned>(actuator)].set_width_us(width_us, now_ns_);
}

uint16_t NativeBoard::read_analog(shoal::Analog input) {
  const double volts = input == shoal::Analog::battery_voltage ? readings.battery_v / SHOAL_BATTERY_VOLTS_PER_VOLT
                                                               : readings.battery_a / SHOAL_BATTERY_AMPS_PER_VOLT;
  return static_cast<uint16_t>(between(0, kReferenceV, volts) / kReferenceV * 1023);
}

uint8_t NativeBoard::read_bytes(shoal::Port port, uint8_t* bytes, uint8_t capacity) {
  uint8_t count = 0;
  while (count < capacity) {
    const int16_t byte = port_of(port).read_byte(now_ns_, noise(port), cut(port), &counters);
    if (byte < 0) break;
    bytes[count++] = static_cast<uint8_t>(byte);
  }
  return count;
}

bool NativeBoard::write_bytes(shoal::Port port, const uint8_t* bytes, uint16_t count) {
  return port_of(port).write_bytes(bytes, count, now_ns_, noise(port), cut(port), &counters);
}

uint8_t NativeBoard::eeprom_read(uint16_t address) {
  if (change_.what != 0) run_until(change_.begun_ns + eeprom_duration_ns(change_.what));
  return eeprom[address % MCU_EEPROM_BYTES];
}

bool NativeBoard::eeprom_write(uint16_t address, uint8_t value) {
  if (!eeprom_ready()) return false;
  change_ = {EEPROM_BOTH, static_cast<uint16_t>(address % MCU_EEPROM_BYTES), value, now_ns_};
  return true;
}

void NativeBoard::feed_watchdog() {
  if (!rebooting_) bites_ns_ = now_ns_ + kWatchdogNs;
}

// On the ATmega2560 this does not return; here the tick that asked is the last one.
void NativeBoard::reboot() {
  rebooting_ = true;
  bites_ns_ = now_ns_ + kRebootNs;
}

}  // namespace shoal_sim
