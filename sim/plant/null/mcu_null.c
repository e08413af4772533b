/* A microcontroller without firmware, for work on hull and sensors alone: it gives the pulses that it is told.
 * The companion port takes frames of six bytes, three little-endian pulse widths (bow, stern, motor) in microseconds,
 * which hold from the frame's time on until the next one. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../mcu/mcu.h"

enum { FRAME_BYTES = 2 * MCU_ACTUATORS, QUEUE = 64 };

typedef struct command {
  uint64_t time_us;
  uint16_t pulse_us[MCU_ACTUATORS];
} command;

struct mcu {
  mcu_readings readings;
  mcu_faults faults;
  mcu_counters counters;
  command queue[QUEUE]; /* in the order of arrival */
  size_t queued;
  uint16_t pulse_us[MCU_ACTUATORS];
};

mcu *mcu_create(const mcu_config *config, char *error, size_t error_size) {
  (void)config;
  mcu *m = calloc(1, sizeof *m);
  if (m == NULL) snprintf(error, error_size, "no memory");
  return m;
}

void mcu_destroy(mcu *m) { free(m); }

int mcu_run_until(mcu *m, uint64_t time_us) {
  while (m->queued > 0 && m->queue[0].time_us < time_us) {
    memcpy(m->pulse_us, m->queue[0].pulse_us, sizeof m->pulse_us);
    memmove(&m->queue[0], &m->queue[1], --m->queued * sizeof m->queue[0]);
  }
  return 0;
}

const char *mcu_failure(const mcu *m) {
  (void)m;
  return "";
}

mcu_readings *mcu_get_readings(mcu *m) { return &m->readings; }

mcu_faults *mcu_get_faults(mcu *m) { return &m->faults; }

const mcu_counters *mcu_get_counters(const mcu *m) { return &m->counters; }

double mcu_pulse_us(const mcu *m, int actuator) { return m->pulse_us[actuator]; }

size_t mcu_uart_write(mcu *m, int port, const uint8_t *bytes, size_t count, uint64_t not_before_us) {
  size_t taken = 0;
  if (port != MCU_PORT_COMPANION) return taken;
  for (; taken + FRAME_BYTES <= count && m->queued < QUEUE; taken += FRAME_BYTES) {
    command *c = &m->queue[m->queued++];
    c->time_us = not_before_us;
    for (int i = 0; i < MCU_ACTUATORS; i++) {
      c->pulse_us[i] = (uint16_t)(bytes[taken + 2 * (size_t)i] | bytes[taken + 2 * (size_t)i + 1] << 8);
    }
  }
  return taken;
}

size_t mcu_uart_read(mcu *m, int port, uint8_t *bytes, size_t capacity) {
  (void)m, (void)port, (void)bytes, (void)capacity;
  return 0;
}

void mcu_eeprom_read(const mcu *m, uint8_t bytes[MCU_EEPROM_BYTES]) {
  (void)m;
  memset(bytes, 0xff, MCU_EEPROM_BYTES);
}

void mcu_power_cycle(mcu *m) {
  m->queued = 0;
  memset(m->pulse_us, 0, sizeof m->pulse_us);
}
