/* The ICM-20948 nine-axis IMU on SPI, register by register (datasheet DS-000189 1.3). Mounted X forward, Y left, Z up,
 * so body forward, right, down is x, -y, -z of its accelerometer and gyroscope. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "../mcu.h"
#include "ak09916.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct icm20948 {
  uint8_t bank[4][128];
  uint8_t selected_bank;
  ak09916 compass;
  bool frozen; /* fault: data registers keep their last sample */

  uint64_t ready_ns;  /* registers answer from here on */
  uint64_t awake_ns;  /* origin of the sample clock: the last time that SLEEP was cleared */
  uint64_t samples;   /* of the internal sample clock since `awake_ns` */
  double filtered[6]; /* accelerometer then gyroscope in the chip's axes, m/s^2 and rad/s */

  bool in_transfer, address_taken, is_read;
  uint8_t address;
} icm20948;

void icm20948_power_on(icm20948 *c, uint64_t now_ns);
/* Takes the samples that are due by `now_ns`, all of these readings. */
void icm20948_run_until(icm20948 *c, const mcu_readings *readings, uint64_t now_ns);

/* Chip select falls or rises. Samples must have been taken up to `now_ns`; a transfer sees one set (section 4.15). */
void icm20948_select(icm20948 *c, bool selected);
/* Exchanges a byte while selected: address with the read flag first, then data at rising addresses (section 6.5). */
uint8_t icm20948_exchange(icm20948 *c, uint8_t in, uint64_t now_ns);

#ifdef __cplusplus
}
#endif
