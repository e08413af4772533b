// Parameter table in flash, lookup by name, range check, and the background copy to EEPROM.
#include "parameters.h"

#include <math.h>
#include <string.h>

#include "../crc.h"
#include "../flash.h"

namespace shoal {
namespace {

// A name longer than 16 characters does not compile.
struct Definition {
  char name[kParameterNameLength + 1];
  float initial, low, high;
};

constexpr Definition kTable[kParameterCount] PROGMEM = {
#define PARAMETER(name, initial, low, high, unit, meaning) {#name, initial, low, high},
#include "table.h"
#undef PARAMETER
};

constexpr uint16_t kEepromBase = 0;

// The stored copy is valid for this very table only.
uint16_t crc_of_table() {
  uint16_t crc = kCrcStart;
  for (const Definition& entry : kTable) {
    const Definition d = read_flash(entry);
    for (char c : d.name) crc = crc_update(crc, static_cast<uint8_t>(c));
  }
  return crc;
}

bool in_range(const Definition& d, float value) { return isfinite(value) && value >= d.low && value <= d.high; }

}  // namespace

Parameters::Parameters() : table_crc_(crc_of_table()) {
  for (uint8_t i = 0; i < kParameterCount; ++i) values_[i] = read_flash(kTable[i]).initial;
}

SetResult Parameters::set(uint8_t index, float value) {
  if (index >= kParameterCount) return SetResult::unknown;
  if (!in_range(read_flash(kTable[index]), value)) return SetResult::out_of_range;
  values_[index] = value;
  begin_store();
  return SetResult::accepted;
}

void Parameters::reset_to_defaults() {
  for (uint8_t i = 0; i < kParameterCount; ++i) values_[i] = read_flash(kTable[i]).initial;
  begin_store();
}

uint8_t Parameters::find(const char* name) {
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    if (strncmp_P(name, kTable[i].name, kParameterNameLength) == 0) return i;
  }
  return kParameterCount;
}

void Parameters::copy_name(uint8_t index, char name[kParameterNameLength]) {
  memcpy_P(name, kTable[index].name, kParameterNameLength);
}

bool Parameters::load(Board& board) {
  float loaded[kParameterCount];
  uint8_t* bytes = reinterpret_cast<uint8_t*>(loaded);
  uint16_t crc = kCrcStart;
  uint16_t table = 0, stored = 0;
  for (uint16_t i = 0; i < kStoredBytes; ++i) {
    const uint8_t byte = board.eeprom_read(kEepromBase + i);
    if (i < 2) {
      table |= static_cast<uint16_t>(byte << (8 * i));
    } else if (i < kStoredBytes - 2) {
      bytes[i - 2] = byte;
    } else {
      stored |= static_cast<uint16_t>(byte << (8 * (i - (kStoredBytes - 2))));
      continue;
    }
    crc = crc_update(crc, byte);
  }
  if (table != table_crc_ || stored != crc) return false;
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    if (!in_range(read_flash(kTable[i]), loaded[i])) return false;
  }
  memcpy(values_, loaded, sizeof values_);
  return true;
}

uint8_t Parameters::stored_byte(uint16_t offset) const {
  if (offset < 2) return static_cast<uint8_t>(table_crc_ >> (8 * offset));
  if (offset >= kStoredBytes - 2) return static_cast<uint8_t>(values_crc_ >> (8 * (offset - (kStoredBytes - 2))));
  return reinterpret_cast<const uint8_t*>(values_)[offset - 2];
}

void Parameters::begin_store() {
  store_at_ = 0;
  values_crc_ = kCrcStart;
}

void Parameters::store_step(Board& board) {
  if (store_at_ >= kStoredBytes || !board.eeprom_ready()) return;
  const uint8_t byte = stored_byte(store_at_);
  if (board.eeprom_read(kEepromBase + store_at_) != byte && !board.eeprom_write(kEepromBase + store_at_, byte)) return;
  if (store_at_ < kStoredBytes - 2) values_crc_ = crc_update(values_crc_, byte);
  ++store_at_;
}

}  // namespace shoal
