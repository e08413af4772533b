/* A byte of EEPROM in time. */
#include "eeprom_cell.h"

uint64_t eeprom_duration_ns(int what) { return what == EEPROM_BOTH ? 3400000 : 1800000; }

uint8_t eeprom_done(const eeprom_change *change, uint8_t old) {
  if (change->what == EEPROM_ERASE) return 0xFF;
  return change->what == EEPROM_WRITE ? old & change->value : change->value;
}

uint8_t eeprom_cut(const eeprom_change *change, uint8_t old, uint64_t now_ns, uint64_t random) {
  if (now_ns >= change->begun_ns + eeprom_duration_ns(change->what)) return eeprom_done(change, old);
  uint8_t unmoved = (uint8_t)random;
  bool erasing = change->what == EEPROM_ERASE ||
                 (change->what == EEPROM_BOTH && now_ns - change->begun_ns < eeprom_duration_ns(EEPROM_ERASE));
  if (erasing) return (uint8_t)(old | (uint8_t)~unmoved);
  uint8_t before = change->what == EEPROM_BOTH ? 0xFF : old;
  return (uint8_t)(eeprom_done(change, before) | (before & unmoved));
}
