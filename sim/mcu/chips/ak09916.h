/* The AK09916 magnetometer inside the ICM-20948, register by register (ICM-20948 datasheet DS-000189 1.3, sections 12
 * and 13). Its axes read as body forward, right, down when the ICM-20948 is mounted X forward, Y left, Z up. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { AK09916_ADDRESS = 0x0C };

typedef struct ak09916 {
  uint8_t mode;        /* CNTL2 */
  uint8_t st1;         /* DRDY bit 0, DOR bit 1 */
  uint8_t st2;         /* HOFL bit 3 */
  uint8_t data[6];     /* HXL .. HZH */
  bool reading;        /* data registers stand still from the first data byte read until ST2 is read */
  uint64_t measure_ns; /* end of the measurement under way */
} ak09916;

void ak09916_power_on(ak09916 *a);
/* Finishes the measurements that end by `now_ns`, all of this field. */
void ak09916_run_until(ak09916 *a, const double field_ut[3], uint64_t now_ns);
uint8_t ak09916_read(ak09916 *a, uint8_t address);
void ak09916_write(ak09916 *a, uint8_t address, uint8_t value, uint64_t now_ns);
/* Automatic increment of the address (section 12). */
uint8_t ak09916_next(uint8_t address);

#ifdef __cplusplus
}
#endif
