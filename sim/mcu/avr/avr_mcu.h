/* The parts of the `avr` make: one simavr core a vehicle, with the peripherals that simavr models too loosely replaced.
 * This library links simavr, which is under the GNU General Public License, version 3; nothing that goes on a vehicle
 * links this library. */
#pragma once

#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_spi.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_twi.h>
#include <simavr/avr_uart.h>
#include <simavr/avr_watchdog.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>
#include <simavr/sim_io.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../../../firmware/src/pins.h"
#include "../chips/icm20948.h"
#include "../chips/ms5837.h"
#include "../eeprom_cell.h"
#include "../line.h"
#include "../mcu.h"
#include "avr_registers.h"

enum { AVR_UARTS = 2, AVR_FLASH_BYTES = 256 * 1024 };

/* A named address of the image's program memory. */
typedef struct avr_image_symbol {
  uint32_t address;
  char *name;
} avr_image_symbol;

typedef struct mcu_spi {
  avr_int_vector_t *vector;
  uint8_t received;
  bool busy, status_read, imu_selected;
} mcu_spi;

typedef enum { TWI_IDLE, TWI_STARTED, TWI_WRITING, TWI_READING } avr_twi_phase;
typedef enum { TWI_NOTHING, TWI_START, TWI_ADDRESS, TWI_SEND, TWI_RECEIVE, TWI_STOP } avr_twi_action;

typedef struct mcu_twi {
  avr_int_vector_t *vector;
  avr_twi_phase phase;
  avr_twi_action action; /* on the wire, or waiting for the bus */
  bool start_after_stop, acknowledge;
  int recovery_clocks; /* on SCL while the bus was held */
  bool scl_low;
} mcu_twi;

typedef struct mcu_uart {
  avr_int_vector_t *receive, *empty, *transmitted;
  uint16_t base; /* data address of UCSRnA */
  double host_bit_ns;
  line to_mcu, to_host;
  uint8_t fifo[3], fifo_error[3]; /* two-byte buffer and shift register (ATmega2560 datasheet, USART, receiver) */
  int fifo_count;
  bool overrun;
  bool shifting, holding; /* transmit shift register and data register in use */
  uint8_t held;
} mcu_uart;

typedef struct mcu_pwm {
  avr_timer_t *timer;
  int channel;
  avr_cycle_count_t rise;     /* of the newest pulse */
  avr_cycle_count_t width;    /* of the newest pulse; 0 when none is open */
  avr_cycle_count_t end;      /* of the last complete pulse */
  avr_cycle_count_t complete; /* width of the last complete pulse */
  uint16_t ddr;
  uint8_t ddr_mask;
} mcu_pwm;

typedef struct mcu_eeprom {
  avr_eeprom_t *store;
  bool armed;
  avr_cycle_count_t arm_end;
  eeprom_change change;
} mcu_eeprom;

/* A handler of simavr's that one of ours wraps. */
typedef struct avr_wrapped_write {
  avr_io_write_t call;
  void *param;
} avr_wrapped_write;
typedef struct avr_wrapped_read {
  avr_io_read_t call;
  void *param;
} avr_wrapped_read;

struct mcu {
  avr_t *avr;
  avr_io_t part;            /* takes part in simavr's resets */
  avr_cycle_count_t target; /* end of the run */
  avr_cycle_count_t start;  /* of the program after the last reset */
  uint64_t seed, power_ups;
  char failure[256];
  avr_image_symbol *symbols;
  size_t symbol_count;

  mcu_readings readings;
  mcu_faults faults;
  mcu_counters counters;
  uint64_t bus_random;

  icm20948 imu;
  ms5837 depth;
  mcu_spi spi;
  mcu_twi twi;
  mcu_uart uart[AVR_UARTS];
  mcu_pwm pwm[MCU_ACTUATORS];
  mcu_eeprom eeprom;
  avr_wrapped_write port_a, ddr_a, port_d, ddr_d, tccr3a, tccr4a;
  avr_wrapped_read pin_a, pin_d;
};

/* A cycle is 62.5 ns. */
static inline uint64_t avr_ns(avr_cycle_count_t cycle) { return cycle * 125 / 2; }
static inline avr_cycle_count_t avr_cycle_at(uint64_t ns) { return (ns * 2 + 124) / 125; }
static inline uint64_t avr_now_ns(const mcu *m) { return avr_ns(m->avr->cycle); }

/* simavr's own module of a kind ("spi", "twi", "uart", "timer" ...) and name ('0', '1' ... or 0), its resets silenced
 * when `replace` is set. */
void *avr_module(avr_t *avr, const char *kind, size_t name_offset, char name, bool replace);
/* Replaces simavr's handlers of a register. */
void avr_on_write(mcu *m, uint16_t address, avr_io_write_t call);
void avr_on_read(mcu *m, uint16_t address, avr_io_read_t call);
/* Puts ours around simavr's handler of a register, which `stock` keeps. */
void avr_wrap_write(mcu *m, uint16_t address, avr_wrapped_write *stock, avr_io_write_t call);
/* Calls a timer back at an absolute cycle. */
void avr_call_at(mcu *m, avr_cycle_count_t cycle, avr_cycle_timer_t call, void *param);
/* Sets or clears a flag bit and what waits for it. */
void avr_set_flag(mcu *m, avr_int_vector_t *vector, bool raised);
/* Brings the chips up to the present. */
void avr_run_chips(mcu *m);

/* Loads an ELF image: program, EEPROM contents and symbols; false with a cause. */
bool avr_load_image(mcu *m, const char *path, char *error, size_t error_size);
/* "name+0x12 (0x1234)" of a program address. */
void avr_describe(const mcu *m, uint32_t address, char *text, size_t size);
void avr_free_symbols(mcu *m);

/* Each part: wiring once, and its state at every reset. */
void avr_spi_attach(mcu *m);
void avr_spi_restart(mcu *m);
void avr_twi_attach(mcu *m);
void avr_twi_restart(mcu *m);
void avr_uart_attach(mcu *m, const mcu_config *config);
void avr_uart_restart(mcu *m);
void avr_pwm_attach(mcu *m);
void avr_pwm_restart(mcu *m);
void avr_eeprom_attach(mcu *m);
void avr_eeprom_restart(mcu *m);
/* What a power cut leaves of the byte that was being written. */
void avr_eeprom_cut(mcu *m);
void avr_pins_attach(mcu *m);
/* SDA and SCL as general pins, after PORTD or DDRD changed. */
void avr_twi_pins_changed(mcu *m);
/* Chip select of the IMU, after PORTA or DDRA changed. */
void avr_spi_pins_changed(mcu *m);
