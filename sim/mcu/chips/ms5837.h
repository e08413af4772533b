/* The MS5837-30BA pressure sensor on I2C, command by command (TE Connectivity datasheet, 10/2015 and rev C2 12/2019).
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "../mcu.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { MS5837_ADDRESS = 0x76, MS5837_PROM_WORDS = 7 };

typedef struct ms5837 {
  uint16_t prom[MS5837_PROM_WORDS];
  uint64_t ready_ns;  /* acknowledges its address from here on */
  uint8_t conversion; /* command under way, or 0 */
  uint64_t converted_ns;
  bool spoiled;    /* the conversion under way was disturbed */
  uint32_t result; /* of the last conversion, 24 bits; 0 once read */
  uint8_t answer[3];
  uint8_t answered, answer_size;
} ms5837;

void ms5837_power_on(ms5837 *d, uint64_t now_ns);
/* Finishes the conversion that ends by `now_ns`, of these readings. */
void ms5837_run_until(ms5837 *d, const mcu_readings *readings, uint64_t now_ns);

/* Whether the chip acknowledges its address, for a command or an answer. */
bool ms5837_start(ms5837 *d, uint64_t now_ns);
void ms5837_write(ms5837 *d, uint8_t command, uint64_t now_ns);
uint8_t ms5837_read(ms5837 *d);

/* CRC-4 of the PROM, whose place in word 0 counts as zero (section "Cyclic redundancy check"). */
uint8_t ms5837_crc4(const uint16_t prom[MS5837_PROM_WORDS]);
/* The raw values from which the datasheet's second-order compensation gives back this pressure and temperature. */
void ms5837_raw(const ms5837 *d, double pressure_pa, double temperature_c, uint32_t *d1, uint32_t *d2);

#ifdef __cplusplus
}
#endif
