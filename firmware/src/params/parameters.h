// The vehicle's parameters: values in RAM, ranges and defaults in flash, a CRC-checked copy in EEPROM.
#pragma once

#include <stdint.h>

#include "../board.h"

namespace shoal {

enum class Parameter : uint8_t {
#define PARAMETER(name, initial, low, high, unit, meaning) name,
#include "table.h"
#undef PARAMETER
  count
};

constexpr uint8_t kParameterCount = static_cast<uint8_t>(Parameter::count);
constexpr uint8_t kParameterNameLength = 16;

enum class SetResult : uint8_t { accepted, unknown, out_of_range };

class Parameters {
 public:
  Parameters();

  float get(Parameter parameter) const { return values_[static_cast<uint8_t>(parameter)]; }
  float at(uint8_t index) const { return values_[index]; }

  // Takes a finite value within the range of the table and stores it in the background; else changes nothing.
  SetResult set(uint8_t index, float value);
  void reset_to_defaults();
  // Writes all values again in the background.
  void store() { begin_store(); }

  // Index of a name of at most 16 characters (terminated when shorter); kParameterCount when there is none.
  static uint8_t find(const char* name);
  // Writes the name, padded with zeros to 16 characters, without terminator when 16 long.
  static void copy_name(uint8_t index, char name[kParameterNameLength]);

  // Reads the stored copy; defaults stand when it is absent, damaged, of another table or out of range.
  bool load(Board& board);
  // Writes at most one changed byte to EEPROM; call once a tick.
  void store_step(Board& board);
  bool storing() const { return store_at_ < kStoredBytes; }

 private:
  static constexpr uint16_t kStoredBytes = 2 + 4 * kParameterCount + 2;  // table's CRC, values, CRC of all before

  uint8_t stored_byte(uint16_t offset) const;
  void begin_store();

  float values_[kParameterCount];
  uint16_t table_crc_;
  uint16_t values_crc_ = 0;
  uint16_t store_at_ = kStoredBytes;
};

}  // namespace shoal
