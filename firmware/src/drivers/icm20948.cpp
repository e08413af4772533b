// Start-up of the ICM-20948 as a table of register writes, its burst read, and the detection of a silent or frozen
// chip.
#ifdef __AVR__
#pragma GCC optimize("O2")  // runs in every tick
#endif

#include "icm20948.h"

#include "../crc.h"
#include "../flash.h"

namespace shoal {
namespace {

// Register map, DS-000189 chapters 7 to 11; AK09916, chapter 13.
enum Bank0 : uint8_t {
  kWhoAmI = 0x00,
  kUserControl = 0x03,
  kPowerManagement1 = 0x06,
  kPowerManagement2 = 0x07,
  kI2cMasterStatus = 0x17,
  kAccelXHigh = 0x2D,
  kBankSelect = 0x7F
};
enum Bank2 : uint8_t {
  kGyroDivider = 0x00,
  kGyroConfig1 = 0x01,
  kOdrAlign = 0x09,
  kAccelDividerHigh = 0x10,
  kAccelDividerLow = 0x11,
  kAccelConfig = 0x14
};
enum Bank3 : uint8_t {
  kI2cMasterOdr = 0x00,
  kI2cMasterControl = 0x01,
  kSlave0Address = 0x03,
  kSlave0Register = 0x04,
  kSlave0Control = 0x05,
  kSlave4Address = 0x13,
  kSlave4Register = 0x14,
  kSlave4Control = 0x15,
  kSlave4DataOut = 0x16
};
constexpr uint8_t kRead = 0x80;
constexpr uint8_t kIdentity = 0xEA;
constexpr uint8_t kCompassAddress = 0x0C;
constexpr uint8_t kCompassStatus1 = 0x10;
constexpr uint8_t kCompassControl2 = 0x31;
constexpr uint8_t kCompassControl3 = 0x32;
constexpr uint8_t kSlave4Done = 0x40;

// A burst from kAccelXHigh: accelerometer 6, gyroscope 6; and on: temperature 2, compass 9 (status 1, field 6, spare,
// status 2).
constexpr uint8_t kShortBurst = 12;
constexpr uint8_t kLongBurst = 23;

constexpr float kAccelScale = kGravity / 8192.0f;    // +-4 g
constexpr float kGyroScale = kDegree / 65.5f;        // +-500 deg/s
constexpr float kFieldScale = 0.15f;                 // uT
constexpr float kTemperatureScale = 1.0f / 333.87f;  // K
constexpr uint8_t kFrozenSamples = 20;               // noise moves some bit of 96 within 0.2 s
constexpr uint8_t kCompassFrozen = 50;               // 1 s
constexpr uint8_t kRetryTicks = 20;

// What a start-up step does after its write.
enum Then : uint8_t { next, await_slave4 };

struct Step {
  uint8_t bank, address, value;
  uint8_t wait_ticks;
  Then then;
};

const Step kStartUp[] PROGMEM = {
    {0, kPowerManagement1, 0x80, 10, next},  // reset, 100 ms
    {0, kPowerManagement1, 0x01, 4, next},   // wake, best clock, 35 ms
    {0, kPowerManagement2, 0x00, 0, next},   // all axes on
    {0, kUserControl, 0x30, 0, next},        // I2C master on, SPI only
    {2, kOdrAlign, 0x01, 0, next},
    {2, kGyroDivider, 4, 0, next},     // 1125 Hz / 5
    {2, kGyroConfig1, 0x23, 0, next},  // low pass 24 Hz, +-500 deg/s
    {2, kAccelDividerHigh, 0, 0, next},
    {2, kAccelDividerLow, 4, 0, next},
    {2, kAccelConfig, 0x23, 0, next},       // low pass 24 Hz, +-4 g
    {3, kI2cMasterControl, 0x17, 0, next},  // 345.6 kHz, stop between reads
    {3, kI2cMasterOdr, 0x03, 0, next},      // 1100 Hz / 8, for when the other sensors sleep
    {3, kSlave4Address, kCompassAddress, 0, next},
    {3, kSlave4Register, kCompassControl3, 0, next},
    {3, kSlave4DataOut, 0x01, 0, next},
    {3, kSlave4Control, 0x80, 1, await_slave4},  // compass: soft reset
    {3, kSlave4Register, kCompassControl2, 0, next},
    {3, kSlave4DataOut, 0x08, 0, next},
    {3, kSlave4Control, 0x80, 1, await_slave4},  // compass: continuous, 100 Hz
    {3, kSlave0Address, kRead | kCompassAddress, 0, next},
    {3, kSlave0Register, kCompassStatus1, 0, next},
    {3, kSlave0Control, 0x89, 2, next},  // nine bytes into EXT_SLV_SENS_DATA
};
constexpr uint8_t kSteps = sizeof kStartUp / sizeof kStartUp[0];
constexpr uint8_t kStepsPerTick = 6;

int16_t big_endian(const uint8_t* bytes) {
  return static_cast<int16_t>(static_cast<uint16_t>(bytes[0]) << 8 | bytes[1]);
}
int16_t little_endian(const uint8_t* bytes) {
  return static_cast<int16_t>(static_cast<uint16_t>(bytes[1]) << 8 | bytes[0]);
}

}  // namespace

void Icm20948::select(uint8_t bank) {
  if (bank == bank_) return;
  uint8_t frame[2] = {kBankSelect, static_cast<uint8_t>(bank << 4)};
  board_.imu_transfer(frame, sizeof frame);
  bank_ = bank;
}

uint8_t Icm20948::read(uint8_t bank, uint8_t address) {
  select(bank);
  uint8_t frame[2] = {static_cast<uint8_t>(kRead | address), 0};
  board_.imu_transfer(frame, sizeof frame);
  return frame[1];
}

void Icm20948::write(uint8_t bank, uint8_t address, uint8_t value) {
  select(bank);
  uint8_t frame[2] = {address, value};
  board_.imu_transfer(frame, sizeof frame);
}

void Icm20948::start_again(ImuState cause) {
  if (cause != ImuState::starting) state_ = cause;
  configured_ = false;
  step_ = 0;
  wait_ = kRetryTicks;
  bank_ = 0xFF;
  same_ = 0;
}

bool Icm20948::step(bool with_compass) {
  if (wait_ > 0) {
    --wait_;
    return false;
  }
  return configured_ ? read_sample(with_compass) : start_step();
}

bool Icm20948::start_step() {
  if (step_ == 0 && read(0, kWhoAmI) != kIdentity) {
    start_again(ImuState::silent);
    return false;
  }
  if (step_ > 0 && read_flash(kStartUp[step_ - 1]).then == await_slave4 && !(read(0, kI2cMasterStatus) & kSlave4Done)) {
    start_again(ImuState::silent);
    return false;
  }
  for (uint8_t i = 0; i < kStepsPerTick && step_ < kSteps; ++i) {
    const Step s = read_flash(kStartUp[step_++]);
    write(s.bank, s.address, s.value);
    if (s.address == kPowerManagement1 && s.bank == 0) bank_ = 0xFF;
    if (s.wait_ticks > 0) {
      wait_ = s.wait_ticks;
      return false;
    }
  }
  if (step_ == kSteps) {
    select(0);
    configured_ = true;
  }
  return false;
}

bool Icm20948::read_sample(bool with_compass) {
  uint8_t frame[1 + kLongBurst] = {kRead | kAccelXHigh};
  board_.imu_transfer(frame, 1 + (with_compass ? kLongBurst : kShortBurst));
  const uint8_t* const accel = frame + 1;
  const uint8_t* const gyro = accel + 6;
  const uint8_t* const temperature = gyro + 6;
  const uint8_t* const compass = temperature + 2;

  uint16_t fingerprint = kCrcStart;
  bool floating = true;  // a bus that nobody drives reads all ones or all zeros
  for (uint8_t i = 0; i < 12; ++i) {
    fingerprint = crc_update(fingerprint, accel[i]);
    floating = floating && accel[i] == accel[0] && (accel[0] == 0xFF || accel[0] == 0x00);
  }
  if (floating) {
    start_again(ImuState::silent);
    return false;
  }
  same_ = fingerprint == fingerprint_ ? same_ + 1 : 0;
  fingerprint_ = fingerprint;
  if (same_ >= kFrozenSamples) {
    start_again(ImuState::frozen);
    return false;
  }

  // The chip is mounted x forward, y left, z up; the compass's own axes are then forward, right, down (figures 12 and
  // 13).
  sample_.specific_force = Vec3{static_cast<float>(big_endian(accel)), -static_cast<float>(big_endian(accel + 2)),
                                -static_cast<float>(big_endian(accel + 4))} *
                           kAccelScale;
  sample_.rate = Vec3{static_cast<float>(big_endian(gyro)), -static_cast<float>(big_endian(gyro + 2)),
                      -static_cast<float>(big_endian(gyro + 4))} *
                 kGyroScale;
  sample_.field_read = with_compass;
  if (with_compass) {
    sample_.temperature_c = static_cast<float>(big_endian(temperature)) * kTemperatureScale + 21.0f;
    read_compass(compass);
  }
  state_ = ImuState::running;
  return true;
}

// The I2C master reads the compass more often than it measures, so its data-ready bit says nothing about this burst; a
// compass that is alive moves by its noise.
void Icm20948::read_compass(const uint8_t* bytes) {
  const int16_t x = little_endian(bytes + 1), y = little_endian(bytes + 3), z = little_endian(bytes + 5);
  const bool overflow = (bytes[8] & 0x08) != 0;
  uint16_t sum = kCrcStart;
  for (uint8_t i = 1; i <= 6; ++i) sum = crc_update(sum, bytes[i]);
  if (sum != compass_sum_) compass_same_ = 0;
  if (compass_same_ < kCompassFrozen) ++compass_same_;
  compass_sum_ = sum;
  sample_.field_valid = compass_same_ < kCompassFrozen && !overflow && (x | y | z) != 0;
  if (!sample_.field_valid) return;
  sample_.field = Vec3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)} * kFieldScale;
}

}  // namespace shoal
