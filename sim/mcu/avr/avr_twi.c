/* The two-wire interface as a master with its true clock, the depth sensor on the bus, and a bus that can be held. */
#include "avr_mcu.h"

/* Status codes of a master (ATmega2560 datasheet, 2-wire serial interface, tables of transmitter and receiver mode). */
enum {
  STATUS_START = 0x08,
  STATUS_REPEATED_START = 0x10,
  STATUS_SLA_W = 0x18,
  STATUS_SENT = 0x28,
  STATUS_LOST = 0x38,
  STATUS_SLA_R = 0x40,
  STATUS_RECEIVED = 0x50,
  STATUS_NO_ACK = 0x08, /* added to a code with acknowledge */
  STATUS_NONE = 0xF8
};
enum { SCL = 0x01, SDA = 0x02, CLOCKS_TO_FREE = 9 };
enum { BUS_RETRY_CYCLES = 160 }; /* how often a transfer that waits for SDA looks again */

static unsigned cycles_per_bit(const mcu *m) {
  const uint8_t *data = m->avr->data;
  return 16u + (2u * data[AVR_TWBR] << (2 * (data[AVR_TWSR] & 3)));
}

static void finish(mcu *m, uint8_t status) {
  uint8_t *data = m->avr->data;
  data[AVR_TWSR] = (uint8_t)((data[AVR_TWSR] & 3) | status);
  m->twi.action = TWI_NOTHING;
  avr_set_flag(m, m->twi.vector, true);
}

static avr_cycle_count_t action_done(avr_t *avr, avr_cycle_count_t when, void *param);

static void begin(mcu *m, avr_twi_action action, unsigned bits) {
  unsigned bit = cycles_per_bit(m);
  uint32_t hz = (uint32_t)(SHOAL_CPU_HZ / bit);
  if (hz > m->counters.i2c_hz) m->counters.i2c_hz = hz;
  m->twi.action = action;
  avr_call_at(m, m->avr->cycle + bits * bit, action_done, m);
}

/* A master that sends a one and sees a zero has lost the bus. */
static bool loses_bus(mcu *m, uint8_t value) {
  if (!m->faults.i2c_held || value == 0) return false;
  m->twi.phase = TWI_IDLE;
  finish(m, STATUS_LOST);
  return true;
}

static void address_done(mcu *m) {
  uint8_t value = m->avr->data[AVR_TWDR];
  if (loses_bus(m, value)) return;
  avr_run_chips(m);
  bool read = value & 1;
  m->twi.acknowledge =
      (value >> 1) == MS5837_ADDRESS && !m->faults.depth_silent && ms5837_start(&m->depth, avr_now_ns(m));
  m->twi.phase = read ? TWI_READING : TWI_WRITING;
  finish(m, (uint8_t)((read ? STATUS_SLA_R : STATUS_SLA_W) + (m->twi.acknowledge ? 0 : STATUS_NO_ACK)));
}

static void send_done(mcu *m) {
  uint8_t value = m->avr->data[AVR_TWDR];
  if (loses_bus(m, value)) return;
  avr_run_chips(m);
  if (m->faults.depth_silent) m->twi.acknowledge = false;
  if (m->twi.acknowledge) ms5837_write(&m->depth, value, avr_now_ns(m));
  finish(m, (uint8_t)(STATUS_SENT + (m->twi.acknowledge ? 0 : STATUS_NO_ACK)));
}

static void receive_done(mcu *m) {
  uint8_t value = 0xFF;
  uint64_t draw = line_random(&m->bus_random);
  if (m->twi.acknowledge && !m->faults.depth_silent) value = ms5837_read(&m->depth);
  if ((double)(draw >> 11) * 0x1p-53 < m->faults.i2c_bit_noise) value ^= (uint8_t)(1u << (draw & 7));
  if (m->faults.i2c_held) value = 0;
  m->avr->data[AVR_TWDR] = value;
  finish(m, (uint8_t)(STATUS_RECEIVED + (m->avr->data[AVR_TWCR] & TWCR_TWEA ? 0 : STATUS_NO_ACK)));
}

static avr_cycle_count_t action_done(avr_t *avr, avr_cycle_count_t when, void *param) {
  mcu *m = param;
  bool needs_free_bus = m->twi.action == TWI_START || m->twi.action == TWI_STOP;
  if (needs_free_bus && m->faults.i2c_held) return when + BUS_RETRY_CYCLES;
  switch (m->twi.action) {
    case TWI_START: {
      bool repeated = m->twi.phase != TWI_IDLE;
      m->twi.phase = TWI_STARTED;
      finish(m, repeated ? STATUS_REPEATED_START : STATUS_START);
      break;
    }
    case TWI_STOP:
      avr->data[AVR_TWCR] &= (uint8_t)~TWCR_TWSTO;
      avr->data[AVR_TWSR] |= STATUS_NONE;
      m->twi.phase = TWI_IDLE;
      m->twi.action = TWI_NOTHING;
      if (m->twi.start_after_stop) begin(m, TWI_START, 1);
      break;
    case TWI_ADDRESS:
      address_done(m);
      break;
    case TWI_SEND:
      send_done(m);
      break;
    case TWI_RECEIVE:
      receive_done(m);
      break;
    case TWI_NOTHING:
      break;
  }
  return 0;
}

static void switch_off(mcu *m) {
  avr_cycle_timer_cancel(m->avr, action_done, m);
  avr_set_flag(m, m->twi.vector, false);
  m->avr->data[AVR_TWSR] |= STATUS_NONE;
  m->twi.action = TWI_NOTHING;
  m->twi.phase = TWI_IDLE;
}

static void write_control(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  uint8_t flag = avr->data[address] & TWCR_TWINT;
  avr->data[address] = (uint8_t)((value & (TWCR_TWEA | TWCR_TWSTA | TWCR_TWSTO | TWCR_TWEN | TWCR_TWIE)) | flag);
  if (!(value & TWCR_TWEN)) {
    switch_off(m);
    return;
  }
  if (value & TWCR_TWINT) avr_set_flag(m, m->twi.vector, false);
  if (avr->data[address] & TWCR_TWINT) { /* the bus waits while the flag stands */
    if (value & TWCR_TWIE) avr_set_flag(m, m->twi.vector, true);
    return;
  }
  if (m->twi.action == TWI_STOP) m->twi.start_after_stop = value & TWCR_TWSTA;
  if (m->twi.action != TWI_NOTHING) return;
  if (value & TWCR_TWSTO) {
    m->twi.start_after_stop = value & TWCR_TWSTA;
    begin(m, TWI_STOP, 1);
  } else if (value & TWCR_TWSTA) {
    begin(m, TWI_START, 1);
  } else if (value & TWCR_TWINT) {
    if (m->twi.phase == TWI_STARTED) begin(m, TWI_ADDRESS, 9);
    if (m->twi.phase == TWI_WRITING) begin(m, TWI_SEND, 9);
    if (m->twi.phase == TWI_READING) begin(m, TWI_RECEIVE, 9);
  }
}

static void write_data(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  (void)param;
  if (avr->data[AVR_TWCR] & TWCR_TWINT)
    avr->data[address] = value;
  else
    avr->data[AVR_TWCR] |= TWCR_TWWC;
}

static void write_status(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  (void)param;
  avr->data[address] = (uint8_t)((avr->data[address] & 0xF8) | (value & 3));
}

/* PIND with the bus lines, which the breakout boards pull up. */
static uint8_t read_pins(avr_t *avr, avr_io_addr_t address, void *param) {
  mcu *m = param;
  uint8_t value = m->pin_d.call(avr, address, m->pin_d.param);
  uint8_t driven_low = avr->data[AVR_DDRD] & (uint8_t)~avr->data[AVR_PORTD] & (SCL | SDA);
  value = (uint8_t)((value | SCL | SDA) & ~driven_low);
  return m->faults.i2c_held ? value & (uint8_t)~SDA : value;
}

void avr_twi_pins_changed(mcu *m) {
  const uint8_t *data = m->avr->data;
  bool low = (data[AVR_DDRD] & SCL) && !(data[AVR_PORTD] & SCL) && !(data[AVR_TWCR] & TWCR_TWEN);
  bool rose = m->twi.scl_low && !low;
  m->twi.scl_low = low;
  if (!rose || m->faults.i2c_held != 2) return;
  if (++m->twi.recovery_clocks < CLOCKS_TO_FREE) return;
  m->twi.recovery_clocks = 0;
  m->faults.i2c_held = 0;
}

void avr_twi_attach(mcu *m) {
  avr_twi_t *stock = avr_module(m->avr, "twi", 0, 0, true);
  m->twi.vector = &stock->twi;
  avr_on_write(m, AVR_TWCR, write_control);
  avr_on_write(m, AVR_TWDR, write_data);
  avr_on_write(m, AVR_TWSR, write_status);
  avr_on_read(m, AVR_TWDR, NULL);
  m->pin_d.call = m->avr->io[AVR_DATA_TO_IO(AVR_PIND)].r.c;
  m->pin_d.param = m->avr->io[AVR_DATA_TO_IO(AVR_PIND)].r.param;
  avr_on_read(m, AVR_PIND, read_pins);
}

void avr_twi_restart(mcu *m) {
  m->twi = (mcu_twi){.vector = m->twi.vector};
  m->avr->data[AVR_TWSR] = STATUS_NONE;
  m->avr->data[AVR_TWDR] = 0xFF;
}
