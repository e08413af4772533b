/* The AK09916 magnetometer at register level. */
#include "ak09916.h"

#include <math.h>

enum {
  WIA1 = 0x00,
  WIA2 = 0x01,
  ST1 = 0x10,
  HXL = 0x11,
  HZH = 0x16,
  TMPS = 0x17,
  ST2 = 0x18,
  CNTL2 = 0x31,
  CNTL3 = 0x32
};
enum { DRDY = 1, DOR = 2, HOFL = 8 };
enum { MODE_DOWN = 0, MODE_SINGLE = 1 };

static const double LSB_UT = 0.15;          /* table 22 */
static const double LIMIT = 32752;          /* table 22 */
static const double OVERFLOW_UT = 4912;     /* sum of the magnitudes of the axes, AK09916 datasheet section 9.4.3.6 */
static const uint64_t MEASURE_NS = 7200000; /* single measurement, AK09916 datasheet section 5.3.3 */

/* Period of the continuous modes 1 to 4; 0 for the others. */
static uint64_t period_ns(uint8_t mode) {
  switch (mode) {
    case 0x02:
      return 100000000;
    case 0x04:
      return 50000000;
    case 0x06:
      return 20000000;
    case 0x08:
      return 10000000;
    default:
      return 0;
  }
}

void ak09916_power_on(ak09916 *a) { *a = (ak09916){0}; }

static void measure(ak09916 *a, const double field_ut[3]) {
  if (a->reading) {
    a->st1 |= DOR;
    return;
  }
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double lsb = fmax(-LIMIT, fmin(LIMIT, nearbyint(field_ut[axis] / LSB_UT)));
    uint16_t word = (uint16_t)(int16_t)lsb;
    a->data[2 * axis] = (uint8_t)word;
    a->data[2 * axis + 1] = (uint8_t)(word >> 8);
    sum += fabs(field_ut[axis]);
  }
  a->st2 = sum >= OVERFLOW_UT ? HOFL : 0;
  if (a->st1 & DRDY) a->st1 |= DOR;
  a->st1 |= DRDY;
}

void ak09916_run_until(ak09916 *a, const double field_ut[3], uint64_t now_ns) {
  while (a->mode != MODE_DOWN && a->measure_ns <= now_ns) {
    measure(a, field_ut);
    uint64_t period = period_ns(a->mode);
    if (!period) a->mode = MODE_DOWN;
    a->measure_ns += period;
  }
}

uint8_t ak09916_next(uint8_t address) {
  if (address == 0x03) return ST1;
  if (address == ST2) return 0x00;
  if (address == CNTL3) return 0x30;
  return (uint8_t)(address + 1);
}

uint8_t ak09916_read(ak09916 *a, uint8_t address) {
  if (address == WIA1) return 0x48;
  if (address == WIA2) return 0x09;
  if (address == ST1) return a->st1;
  if (address == CNTL2) return a->mode;
  if (address >= HXL && address <= TMPS) {
    a->st1 = 0;
    a->reading = period_ns(a->mode) != 0;
    return address <= HZH ? a->data[address - HXL] : 0;
  }
  if (address == ST2) {
    a->st1 = 0;
    a->reading = false;
    return a->st2;
  }
  return 0;
}

void ak09916_write(ak09916 *a, uint8_t address, uint8_t value, uint64_t now_ns) {
  if (address == CNTL3 && (value & 1)) ak09916_power_on(a);
  if (address != CNTL2) return;
  value &= 0x1F;
  bool known = value == MODE_SINGLE || period_ns(value);
  if (known && value == a->mode && period_ns(value)) return; /* writing the running mode again changes nothing */
  a->mode = known ? value : MODE_DOWN;
  a->reading = false;
  a->measure_ns = now_ns + MEASURE_NS;
}
