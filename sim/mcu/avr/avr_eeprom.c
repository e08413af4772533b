/* EEPROM with its write time, its arming window, and what a power cut leaves of a byte. */
#include <stddef.h>
#include <string.h>

#include "avr_mcu.h"

/* ATmega2560 datasheet, "EEPROM Mode Bits" and the four cycles of EEMPE. */
enum { MODE_BOTH = 0x00, MODE_ERASE = 0x10, MODE_WRITE = 0x20, ARM_CYCLES = 4 };
static const avr_cycle_count_t BOTH_CYCLES = SHOAL_CPU_HZ / 10000 * 34;   /* 3.4 ms */
static const avr_cycle_count_t SINGLE_CYCLES = SHOAL_CPU_HZ / 10000 * 18; /* 1.8 ms */

static uint8_t *cell(mcu *m) { return &m->eeprom.store->eeprom[m->eeprom.address]; }

static uint8_t written(const mcu_eeprom *e, uint8_t old) {
  if (e->mode == MODE_ERASE) return 0xFF;
  return e->mode == MODE_WRITE ? old & e->value : e->value;
}

static avr_cycle_count_t write_done(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  mcu *m = param;
  *cell(m) = written(&m->eeprom, *cell(m));
  m->eeprom.writing = false;
  avr->data[AVR_EECR] &= (uint8_t)~EECR_EEPE;
  avr_set_flag(m, &m->eeprom.store->ready, true);
  return 0;
}

static uint16_t selected(const mcu *m) {
  return (uint16_t)((m->avr->data[AVR_EEARH] << 8 | m->avr->data[AVR_EEARL]) % MCU_EEPROM_BYTES);
}

static void begin_write(mcu *m, uint8_t mode) {
  mcu_eeprom *e = &m->eeprom;
  e->writing = true;
  e->armed = false;
  e->mode = mode;
  e->address = selected(m);
  e->value = m->avr->data[AVR_EEDR];
  e->begun = m->avr->cycle;
  e->end = e->begun + (mode == MODE_BOTH ? BOTH_CYCLES : SINGLE_CYCLES);
  avr_call_at(m, e->end, write_done, m);
}

static void write_control(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  mcu_eeprom *e = &m->eeprom;
  uint8_t before = avr->data[address];
  bool armed = e->armed && avr->cycle <= e->arm_end;
  if (e->writing) value = (uint8_t)((value & ~EECR_EEPM) | (before & EECR_EEPM));
  if ((value & EECR_EEPE) && armed && !e->writing) {
    begin_write(m, value & EECR_EEPM);
  } else if (value & EECR_EEMPE) {
    e->armed = true;
    e->arm_end = avr->cycle + ARM_CYCLES;
  } else if ((value & EECR_EERE) && !e->writing) {
    avr->data[AVR_EEDR] = e->store->eeprom[selected(m)];
  }
  avr->data[address] = (uint8_t)((value & (EECR_EERIE | EECR_EEPM)) | (e->armed ? EECR_EEMPE : 0) | (e->writing ? EECR_EEPE : 0));
  bool enabled_now = (value & EECR_EERIE) && !(before & EECR_EERIE);
  if (enabled_now && !e->writing) avr_set_flag(m, &e->store->ready, true);
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

/* A write that is under way at a reset is completed (datasheet, "EEPROM Write During Power-down" and EEPE). */
void avr_eeprom_restart(mcu *m) {
  m->eeprom.armed = false;
  if (!m->eeprom.writing) return;
  m->avr->data[AVR_EECR] = EECR_EEPE;
  avr_call_at(m, m->eeprom.end, write_done, m);
}

/* Erasing raises bits, writing lowers them: a cut leaves some bits still undone. */
void avr_eeprom_cut(mcu *m) {
  mcu_eeprom *e = &m->eeprom;
  if (!e->writing) return;
  e->writing = false;
  uint8_t undone = (uint8_t)line_random(&m->bus_random);
  bool erasing = e->mode == MODE_ERASE || (e->mode == MODE_BOTH && m->avr->cycle < e->begun + SINGLE_CYCLES);
  uint8_t before = e->mode == MODE_BOTH ? 0xFF : *cell(m);
  *cell(m) = erasing ? *cell(m) | (uint8_t)~undone : written(e, before) | (before & undone);
}

void mcu_eeprom_read(const mcu *m, uint8_t bytes[MCU_EEPROM_BYTES]) { memcpy(bytes, m->eeprom.store->eeprom, MCU_EEPROM_BYTES); }
