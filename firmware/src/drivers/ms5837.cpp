// Start-up, interleaved conversions and second-order compensation of the MS5837-30BA.
#include "ms5837.h"

namespace shoal {
namespace {

constexpr uint8_t kAddress = 0x76;
constexpr uint8_t kReset = 0x1E;
constexpr uint8_t kReadProm = 0xA0;
constexpr uint8_t kReadAdc = 0x00;
constexpr uint8_t kConvertPressure = 0x4A;     // OSR 8192, at most 18.08 ms
constexpr uint8_t kConvertTemperature = 0x5A;  // OSR 8192
constexpr uint8_t kResetSteps = 1;
constexpr uint8_t kRetrySteps = 10;
constexpr uint8_t kPressuresPerTemperature = 4;
constexpr float kPascal = 10.0f;      // per count of 0.1 mbar
constexpr int32_t kHighest = 320000;  // 0.1 mbar: 30 bar and some margin

}  // namespace

bool ms5837_prom_valid(const uint16_t prom[7]) {
  uint16_t remainder = 0;
  for (uint8_t i = 0; i < 16; ++i) {
    uint16_t word = i / 2 < 7 ? prom[i / 2] : 0;
    if (i / 2 == 0) word &= 0x0FFF;
    remainder ^= i % 2 ? (word & 0x00FF) : (word >> 8);
    for (uint8_t bit = 0; bit < 8; ++bit) {
      remainder = static_cast<uint16_t>(remainder & 0x8000 ? (remainder << 1) ^ 0x3000 : remainder << 1);
    }
  }
  return remainder >> 12 == prom[0] >> 12 && prom[1] != 0;
}

bool Ms5837::command(uint8_t code) { return board_.i2c_write(kAddress, &code, 1); }

void Ms5837::start_again() {
  phase_ = Phase::reset;
  valid_ = false;
  wait_ = kRetrySteps;
}

// Starts a conversion; its result is ready at the next step.
bool Ms5837::convert(bool temperature) {
  temperature_running_ = temperature;
  return command(temperature ? kConvertTemperature : kConvertPressure);
}

bool Ms5837::read_prom_word() {
  uint8_t bytes[2];
  if (!command(static_cast<uint8_t>(kReadProm + 2 * word_)) || !board_.i2c_read(kAddress, bytes, 2)) return false;
  prom_[word_++] = static_cast<uint16_t>(bytes[0] << 8 | bytes[1]);
  return true;
}

bool Ms5837::step() {
  if (wait_ > 0) {
    --wait_;
    return false;
  }
  switch (phase_) {
    case Phase::reset:
      if (!command(kReset)) {
        start_again();
        return false;
      }
      word_ = 0;
      wait_ = kResetSteps;
      phase_ = Phase::read_prom;
      return false;

    case Phase::read_prom:
      if (!read_prom_word()) {
        start_again();
      } else if (word_ == 7) {
        if (!ms5837_prom_valid(prom_) || !convert(true)) {
          start_again();
          return false;
        }
        phase_ = Phase::converting;
      }
      return false;

    case Phase::converting:
      break;
  }

  uint8_t bytes[3];
  if (!command(kReadAdc) || !board_.i2c_read(kAddress, bytes, 3)) {
    start_again();
    return false;
  }
  const bool was_temperature = temperature_running_;
  since_temperature_ = was_temperature ? 0 : since_temperature_ + 1;
  if (!convert(since_temperature_ >= kPressuresPerTemperature)) {
    start_again();
    return false;
  }
  const uint32_t raw = static_cast<uint32_t>(bytes[0]) << 16 | static_cast<uint32_t>(bytes[1]) << 8 | bytes[2];
  if (raw == 0) return false;  // the chip answers 0 when the conversion had not ended
  if (was_temperature) {
    compensate_temperature(raw);
    return false;
  }
  return compensate_pressure(raw);
}

// Temperature, and the offset and sensitivity that follow from it (data sheet, figures 3 and 4).
void Ms5837::compensate_temperature(uint32_t raw) {
  const int32_t dt = static_cast<int32_t>(raw) - (static_cast<int32_t>(prom_[5]) << 8);
  int32_t t = 2000 + static_cast<int32_t>((static_cast<int64_t>(dt) * prom_[6]) >> 23);
  offset_ = (static_cast<int64_t>(prom_[2]) << 16) + ((static_cast<int64_t>(prom_[4]) * dt) >> 7);
  sensitivity_ = (static_cast<int64_t>(prom_[1]) << 15) + ((static_cast<int64_t>(prom_[3]) * dt) >> 8);

  const int64_t dt2 = static_cast<int64_t>(dt) * dt;
  const int64_t cold = static_cast<int64_t>(t - 2000) * (t - 2000);
  if (t < 2000) {
    offset_ -= 3 * cold / 2;
    sensitivity_ -= 5 * cold / 8;
    if (t < -1500) {
      const int64_t very_cold = static_cast<int64_t>(t + 1500) * (t + 1500);
      offset_ -= 7 * very_cold;
      sensitivity_ -= 4 * very_cold;
    }
    t -= static_cast<int32_t>((3 * dt2) >> 33);
  } else {
    offset_ -= cold / 16;
    t -= static_cast<int32_t>((2 * dt2) >> 37);
  }
  temperature_ = t;
}

bool Ms5837::compensate_pressure(uint32_t raw) {
  if (sensitivity_ == 0) return false;
  const int64_t pressure = (((static_cast<int64_t>(raw) * sensitivity_) >> 21) - offset_) >> 13;
  if (pressure <= 0 || pressure > kHighest) return false;
  pressure_pa_ = static_cast<float>(static_cast<int32_t>(pressure)) * kPascal;
  valid_ = true;
  return true;
}

}  // namespace shoal
