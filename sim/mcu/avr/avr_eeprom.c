/* EEPROM with its write time, its arming window, and what a power cut leaves of a byte. */
#include <stddef.h>
#include <string.h>

#include "avr_mcu.h"

enum { ARM_CYCLES = 4 }; /* in which EEPE must follow EEMPE */

static uint8_t *cell(mcu *m) { return &m->eeprom.store->eeprom[m->eeprom.change.address]; }

static avr_cycle_count_t write_done(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  mcu *m = param;
  *cell(m) = eeprom_done(&m->eeprom.change, *cell(m));
  m->eeprom.change.what = 0;
  avr->data[AVR_EECR] &= (uint8_t)~EECR_EEPE;
  avr_set_flag(m, &m->eeprom.store->ready, true);
  return 0;
}

static uint16_t selected(const mcu *m) {
  return (uint16_t)((m->avr->data[AVR_EEARH] << 8 | m->avr->data[AVR_EEARL]) % MCU_EEPROM_BYTES);
}

static avr_cycle_count_t end_of_change(const mcu *m) {
  return avr_cycle_at(m->eeprom.change.begun_ns + eeprom_duration_ns(m->eeprom.change.what));
}

static void begin_change(mcu *m, uint8_t mode) {
  m->eeprom.armed = false;
  m->eeprom.change = (eeprom_change){
      .what = mode == EECR_EEPM0   ? EEPROM_ERASE
              : mode == EECR_EEPM1 ? EEPROM_WRITE
                                   : EEPROM_BOTH,
      .address = selected(m),
      .value = m->avr->data[AVR_EEDR],
      .begun_ns = avr_now_ns(m),
  };
  avr_call_at(m, end_of_change(m), write_done, m);
}

static void write_control(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  mcu_eeprom *e = &m->eeprom;
  uint8_t before = avr->data[address];
  bool armed = e->armed && avr->cycle <= e->arm_end;
  if (e->change.what) value = (uint8_t)((value & ~EECR_EEPM) | (before & EECR_EEPM));
  if ((value & EECR_EEPE) && armed && !e->change.what) {
    begin_change(m, value & EECR_EEPM);
  } else if (value & EECR_EEMPE) {
    e->armed = true;
    e->arm_end = avr->cycle + ARM_CYCLES;
  } else if ((value & EECR_EERE) && !e->change.what) {
    avr->data[AVR_EEDR] = e->store->eeprom[selected(m)];
  }
  avr->data[address] =
      (uint8_t)((value & (EECR_EERIE | EECR_EEPM)) | (e->armed ? EECR_EEMPE : 0) | (e->change.what ? EECR_EEPE : 0));
  bool enabled_now = (value & EECR_EERIE) && !(before & EECR_EERIE);
  if (enabled_now && !e->change.what) avr_set_flag(m, &e->store->ready, true);
}

static uint8_t read_control(avr_t *avr, avr_io_addr_t address, void *param) {
  mcu *m = param;
  if (m->eeprom.armed && avr->cycle > m->eeprom.arm_end) {
    m->eeprom.armed = false;
    avr->data[address] &= (uint8_t)~EECR_EEMPE;
  }
  return avr->data[address];
}

void avr_eeprom_attach(mcu *m) {
  m->eeprom.store = avr_module(m->avr, "eeprom", 0, 0, true);
  avr_on_write(m, AVR_EECR, write_control);
  avr_on_read(m, AVR_EECR, read_control);
}

/* A change that is under way at a reset is completed (datasheet, "EEPE"). */
void avr_eeprom_restart(mcu *m) {
  m->eeprom.armed = false;
  if (!m->eeprom.change.what) return;
  m->avr->data[AVR_EECR] = EECR_EEPE;
  avr_call_at(m, end_of_change(m), write_done, m);
}

void avr_eeprom_cut(mcu *m) {
  if (m->eeprom.change.what)
    *cell(m) = eeprom_cut(&m->eeprom.change, *cell(m), avr_now_ns(m), line_random(&m->bus_random));
  m->eeprom.change.what = 0;
}

void mcu_eeprom_read(const mcu *m, uint8_t bytes[MCU_EEPROM_BYTES]) {
  memcpy(bytes, m->eeprom.store->eeprom, MCU_EEPROM_BYTES);
}
