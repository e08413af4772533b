/* The MS5837-30BA: PROM with CRC, conversions that take their time, and the inverse of its compensation. */
#include "ms5837.h"

#include <math.h>

enum { RESET = 0x1E, ADC_READ = 0x00, PROM_READ = 0xA0, CONVERT_D1 = 0x40, CONVERT_D2 = 0x50 };

/* "Typical values" of the flow chart of pressure and temperature calculation; word 0 names the product in bits 11 to 5.
 */
static const uint16_t TYPICAL[MS5837_PROM_WORDS] = {0x1A << 5, 34982, 36352, 20328, 22354, 26646, 26146};

static const uint64_t RELOAD_NS = 2800000; /* PROM reload after a reset, as for the MS5803 of the same family */

/* ADC performance specifications: longest conversion by oversampling 256 to 8192, nanoseconds. */
static const uint64_t CONVERSION_NS[6] = {600000, 1170000, 2280000, 4540000, 9040000, 18080000};

uint8_t ms5837_crc4(const uint16_t prom[MS5837_PROM_WORDS]) {
  uint16_t remainder = 0;
  for (int byte = 0; byte < 16; ++byte) {
    uint16_t word = byte / 2 < MS5837_PROM_WORDS ? prom[byte / 2] : 0;
    if (byte < 2) word &= 0x0FFF;
    remainder ^= byte % 2 ? word & 0xFF : word >> 8;
    for (int bit = 0; bit < 8; ++bit) remainder = (uint16_t)(remainder << 1) ^ (remainder & 0x8000 ? 0x3000 : 0);
  }
  return (uint8_t)(remainder >> 12);
}

void ms5837_power_on(ms5837 *d, uint64_t now_ns) {
  *d = (ms5837){.ready_ns = now_ns + RELOAD_NS};
  for (int i = 0; i < MS5837_PROM_WORDS; ++i) d->prom[i] = TYPICAL[i];
  d->prom[0] |= (uint16_t)(ms5837_crc4(d->prom) << 12);
}

static double square(double x) { return x * x; }

void ms5837_raw(const ms5837 *d, double pressure_pa, double temperature_c, uint32_t *d1, uint32_t *d2) {
  const uint16_t *c = d->prom;
  double wanted = temperature_c * 100, temp = wanted, dt = 0; /* hundredths of a degree */
  bool cold = wanted < 2000;
  for (int i = 0; i < 8; ++i) { /* the correction is far smaller than the value: a contraction */
    dt = (temp - 2000) * 0x1p23 / c[6];
    temp = wanted + (cold ? 3 * square(dt) * 0x1p-33 : 2 * square(dt) * 0x1p-37);
  }
  dt = (temp - 2000) * 0x1p23 / c[6];
  double offset = c[2] * 0x1p16 + c[4] * dt * 0x1p-7;
  double sensitivity = c[1] * 0x1p15 + c[3] * dt * 0x1p-8;
  if (cold) {
    offset -= 1.5 * square(temp - 2000);
    sensitivity -= 0.625 * square(temp - 2000);
    if (temp < -1500) {
      offset -= 7 * square(temp + 1500);
      sensitivity -= 4 * square(temp + 1500);
    }
  } else {
    offset -= square(temp - 2000) / 16;
  }
  double tenth_mbar = fmax(0, fmin(300000, pressure_pa / 10)); /* range 0 to 30 bar */
  *d1 = (uint32_t)fmax(0, fmin(0xFFFFFF, nearbyint((tenth_mbar * 0x1p13 + offset) * 0x1p21 / sensitivity)));
  *d2 = (uint32_t)fmax(0, fmin(0xFFFFFF, nearbyint(c[5] * 256.0 + dt)));
}

void ms5837_run_until(ms5837 *d, const mcu_readings *readings, uint64_t now_ns) {
  if (!d->conversion || d->converted_ns > now_ns) return;
  uint32_t d1, d2;
  ms5837_raw(d, readings->pressure_pa, readings->water_temperature_c, &d1, &d2);
  d->result = (d->conversion & 0xF0) == CONVERT_D1 ? d1 : d2;
  if (d->spoiled) d->result >>= 1;
  d->conversion = 0;
}

bool ms5837_start(ms5837 *d, uint64_t now_ns) {
  d->answered = 0;
  return now_ns >= d->ready_ns;
}

void ms5837_write(ms5837 *d, uint8_t command, uint64_t now_ns) {
  d->answered = d->answer_size = 0;
  if (command == RESET) {
    ms5837_power_on(d, now_ns);
  } else if (command == ADC_READ) {
    /* A read during the conversion gives 0 and spoils it ("Conversion sequence"). */
    if (d->conversion) d->spoiled = true;
    uint32_t value = d->conversion ? 0 : d->result;
    d->result = 0;
    for (int i = 0; i < 3; ++i) d->answer[i] = (uint8_t)(value >> (16 - 8 * i));
    d->answer_size = 3;
  } else if ((command & 0xF1) == PROM_READ) {
    unsigned word = (command >> 1) & 7;
    uint16_t value = word < MS5837_PROM_WORDS ? d->prom[word] : 0;
    d->answer[0] = (uint8_t)(value >> 8);
    d->answer[1] = (uint8_t)value;
    d->answer_size = 2;
  } else if (((command & 0xF0) == CONVERT_D1 || (command & 0xF0) == CONVERT_D2) && (command & 0x0F) <= 0x0A) {
    d->spoiled = d->conversion != 0;
    d->conversion = command;
    d->converted_ns = now_ns + CONVERSION_NS[(command & 0x0F) >> 1];
    d->result = 0;
  }
}

uint8_t ms5837_read(ms5837 *d) { return d->answered < d->answer_size ? d->answer[d->answered++] : 0; }
