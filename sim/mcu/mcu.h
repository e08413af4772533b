/* A microcontroller that runs the vehicle's firmware with its chips wired to it; two makes stand behind it:
 * `avr` (the flashed image in simavr) and `native` (the same sources compiled for the host). */
#pragma once

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mcu mcu;

enum { MCU_PORT_CONSOLE = 0, MCU_PORT_COMPANION = 1 };
enum { MCU_BOW = 0, MCU_STERN = 1, MCU_MOTOR = 2, MCU_ACTUATORS = 3 };
enum { MCU_EEPROM_BYTES = 4096 };

/* What the chips measure at this moment, noise and bias included. Body frame: forward, right, down. */
typedef struct mcu_readings {
  double specific_force_mps2[3];
  double rate_rps[3];
  double field_ut[3];
  double imu_temperature_c;
  double pressure_pa; /* absolute */
  double water_temperature_c;
  double battery_v;
  double battery_a;
  int leak;
} mcu_readings;

/* Faults that a test or a scenario injects; all zero is a healthy vehicle. */
typedef struct mcu_faults {
  int imu_silent;       /* SPI reads all ones */
  int imu_frozen;       /* data registers keep their last sample */
  int depth_silent;     /* no acknowledge */
  int i2c_held;         /* SDA held low: 1 until cleared here, 2 until nine clocks on SCL free it (then 0 again) */
  double i2c_bit_noise; /* probability that a byte read over I2C has one bit flipped */
  int companion_cut;    /* no byte passes in either direction */
  double companion_bit_noise; /* probability that a byte on the wire has one bit flipped */
} mcu_faults;

/* Counters since creation. Cycles are 0 for `native`. */
typedef struct mcu_counters {
  uint64_t cycles;
  uint64_t cycles_asleep;
  uint64_t resets;      /* by watchdog, and by mcu_power_cycle */
  uint64_t rx_overruns; /* bytes that the UART hardware lost because the firmware read too late */
  uint64_t rx_corrupted;
  uint64_t tx_corrupted;
  uint32_t spi_hz, i2c_hz; /* the fastest clock that the firmware programmed and used */
} mcu_counters;

typedef struct mcu_config {
  const char *image;     /* ELF for `avr`; unused for `native` */
  uint64_t seed;         /* of the line noise */
  uint32_t baud;         /* of the companion's end of the line; the firmware's end is what it programs */
  const uint8_t *eeprom; /* MCU_EEPROM_BYTES bytes, or NULL for an erased one */
} mcu_config;

/* From any reset to the program's first instruction (ATmega2560 datasheet, start-up times of the crystal oscillator
 * with the fuses of the Arduino Mega). Pulses and lines are silent meanwhile, and what arrives is lost. */
enum { MCU_START_UP_US = 65000 };

/* Makes one, powered and in reset at time 0; NULL with a cause in `error` when it cannot. */
mcu *mcu_create(const mcu_config *config, char *error, size_t error_size);
void mcu_destroy(mcu *m);

/* Runs until the absolute time; 0, or -1 with a cause (symbol and address) from mcu_failure. */
int mcu_run_until(mcu *m, uint64_t time_us);
const char *mcu_failure(const mcu *m);

/* Readings and faults are read whenever firmware asks a chip; they may be changed between runs. */
mcu_readings *mcu_get_readings(mcu *m);
mcu_faults *mcu_get_faults(mcu *m);
const mcu_counters *mcu_get_counters(const mcu *m);

/* Width of the last complete pulse, microseconds; 0 when no pulse came for 50 ms. */
double mcu_pulse_us(const mcu *m, int actuator);

/* Host to firmware: bytes enter the line one after another at the baud, not before `not_before_us`. Returns bytes
 * taken. */
size_t mcu_uart_write(mcu *m, int port, const uint8_t *bytes, size_t count, uint64_t not_before_us);
/* Firmware to host: bytes whose stop bit has passed. */
size_t mcu_uart_read(mcu *m, int port, uint8_t *bytes, size_t capacity);

void mcu_eeprom_read(const mcu *m, uint8_t bytes[MCU_EEPROM_BYTES]);
/* Power off and on: RAM is lost, EEPROM kept, time goes on. */
void mcu_power_cycle(mcu *m);

#ifdef __cplusplus
}
#endif
