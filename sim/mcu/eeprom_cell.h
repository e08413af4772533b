/* A byte of the ATmega2560's EEPROM: how long erasing and writing take, and what a power cut in between leaves
 * (datasheet 2549, "EEPROM Mode Bits"; erasing raises bits, writing lowers them). */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { EEPROM_ERASE = 1, EEPROM_WRITE = 2, EEPROM_BOTH = 3 };

typedef struct eeprom_change {
  int what; /* EEPROM_ERASE, EEPROM_WRITE or EEPROM_BOTH; 0 when none is under way */
  uint16_t address;
  uint8_t value;
  uint64_t begun_ns;
} eeprom_change;

uint64_t eeprom_duration_ns(int what);
/* The cell's contents when the change is complete. */
uint8_t eeprom_done(const eeprom_change *change, uint8_t old);
/* The cell's contents when power goes at `now_ns`; `random` chooses the bits that had not moved yet. */
uint8_t eeprom_cut(const eeprom_change *change, uint8_t old, uint64_t now_ns, uint64_t random);

#ifdef __cplusplus
}
#endif
