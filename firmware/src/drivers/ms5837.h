// MS5837-30BA depth sensor (TE Connectivity data sheet of 05/2017) over I2C: absolute pressure and water temperature.
#pragma once

#include <stdint.h>

#include "../board.h"

namespace shoal {

class Ms5837 {
 public:
  explicit Ms5837(Board& board) : board_(board) {}

  // Advances start-up or the running conversion without waiting; true when `pressure_pa()` is new. Call every 20 ms.
  bool step();

  float pressure_pa() const { return pressure_pa_; }
  float temperature_c() const { return static_cast<float>(temperature_) * 0.01f; }
  // False from the first failed transfer until a sample comes again.
  bool running() const { return phase_ == Phase::converting && valid_; }

 private:
  enum class Phase : uint8_t { reset, read_prom, converting };

  void start_again();
  bool command(uint8_t code);
  bool convert(bool temperature);
  bool read_prom_word();
  void compensate_temperature(uint32_t raw);
  bool compensate_pressure(uint32_t raw);

  Board& board_;
  uint16_t prom_[7] = {};
  Phase phase_ = Phase::reset;
  bool valid_ = false;
  bool temperature_running_ = false;
  uint8_t word_ = 0;
  uint8_t wait_ = 0;
  uint8_t since_temperature_ = 0;
  int32_t temperature_ = 2000;  // 0.01 C
  int64_t offset_ = 0;
  int64_t sensitivity_ = 0;
  float pressure_pa_ = 0.0f;
};

// The data sheet's check of PROM words 0 to 6: true when the CRC-4 in the top bits of word 0 is right
// and the words are not all zero.
bool ms5837_prom_valid(const uint16_t prom[7]);

}  // namespace shoal
