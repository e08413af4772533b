/* The ICM-20948 at register level: banks, power, filters, sample clock and the I2C master with its magnetometer. */
#include "icm20948.h"

#include <math.h>
#include <string.h>

/* Section 7, register map. */
enum { REG_BANK_SEL = 0x7F };
enum {
  WHO_AM_I = 0x00,
  USER_CTRL = 0x03,
  LP_CONFIG = 0x05,
  PWR_MGMT_1 = 0x06,
  PWR_MGMT_2 = 0x07,
  I2C_MST_STATUS = 0x17,
  INT_STATUS_1 = 0x1A,
  ACCEL_XOUT_H = 0x2D,
  GYRO_XOUT_H = 0x33,
  TEMP_OUT_H = 0x39,
  EXT_SLV_SENS_DATA_00 = 0x3B,
  EXT_SLV_SENS_DATA_23 = 0x52
};
enum {
  GYRO_SMPLRT_DIV = 0x00,
  GYRO_CONFIG_1 = 0x01,
  ACCEL_SMPLRT_DIV_1 = 0x10,
  ACCEL_SMPLRT_DIV_2 = 0x11,
  ACCEL_CONFIG = 0x14
};
enum { I2C_SLV0_ADDR = 0x03, I2C_SLV4_ADDR = 0x13, I2C_SLV4_REG, I2C_SLV4_CTRL, I2C_SLV4_DO, I2C_SLV4_DI };
enum { DEVICE_RESET = 0x80, SLEEP = 0x40, CLOCK_STOPPED = 7, I2C_MST_EN = 0x20 };
enum { SLV_EN = 0x80, SLV_READ = 0x80, SLV_REG_DIS = 0x20, SLV4_DONE = 0x40, SLV4_NACK = 0x10 };

static const uint64_t REGISTERS_READY_NS = 11000000; /* table 1, start-up time for register read/write */
static const uint64_t GYRO_START_NS = 35000000;      /* table 1, from sleep mode */
static const uint64_t ACCEL_START_NS = 20000000;     /* table 2, from sleep mode */
static const double GRAVITY = 9.80665;

/* Tables 16 and 18: 3 dB bandwidth by DLPFCFG, hertz. */
static const double GYRO_BANDWIDTH[8] = {196.6, 151.8, 119.5, 51.2, 23.9, 11.6, 5.7, 361.4};
static const double ACCEL_BANDWIDTH[8] = {246.0, 246.0, 111.4, 50.4, 23.9, 11.5, 5.7, 473.0};

static void reset_registers(icm20948 *c, uint64_t now_ns) {
  memset(c->bank, 0, sizeof c->bank);
  c->bank[0][WHO_AM_I] = 0xEA;
  c->bank[0][LP_CONFIG] = 0x40;
  c->bank[0][PWR_MGMT_1] = SLEEP | 1;
  c->bank[2][GYRO_CONFIG_1] = 0x01;
  c->bank[2][ACCEL_CONFIG] = 0x01;
  c->selected_bank = 0;
  c->ready_ns = now_ns + REGISTERS_READY_NS;
}

void icm20948_power_on(icm20948 *c, uint64_t now_ns) {
  *c = (icm20948){.frozen = c->frozen};
  ak09916_power_on(&c->compass);
  reset_registers(c, now_ns);
}

static bool awake(const icm20948 *c) {
  uint8_t power = c->bank[0][PWR_MGMT_1];
  return !(power & SLEEP) && (power & 7) != CLOCK_STOPPED;
}

static void put_word(icm20948 *c, uint8_t address, double value) {
  uint16_t word = (uint16_t)(int16_t)fmax(-32768, fmin(32767, nearbyint(value)));
  c->bank[0][address] = (uint8_t)(word >> 8);
  c->bank[0][address + 1] = (uint8_t)word;
}

/* One step of a first-order low pass of the DLPF's bandwidth at the internal rate of 1125 Hz (sections 10.2 and 10.15);
 * with FCHOICE cleared the filter is bypassed. */
static double low_pass_gain(uint8_t config, const double bandwidth[8]) {
  if (!(config & 1)) return 1;
  return 1 - exp(-2 * M_PI * bandwidth[(config >> 3) & 7] / 1125);
}

static void filter(icm20948 *c, const mcu_readings *r) {
  static const double TO_CHIP[3] = {1, -1, -1};
  double accel_gain = low_pass_gain(c->bank[2][ACCEL_CONFIG], ACCEL_BANDWIDTH);
  double gyro_gain = low_pass_gain(c->bank[2][GYRO_CONFIG_1], GYRO_BANDWIDTH);
  for (int axis = 0; axis < 3; ++axis) {
    c->filtered[axis] += accel_gain * (TO_CHIP[axis] * r->specific_force_mps2[axis] - c->filtered[axis]);
    c->filtered[axis + 3] += gyro_gain * (TO_CHIP[axis] * r->rate_rps[axis] - c->filtered[axis + 3]);
  }
}

/* Fills the data registers whose output instant this internal sample is (tables 1 and 2: sensitivity scale factors). */
static bool latch(icm20948 *c, const mcu_readings *r, uint64_t since_wake_ns) {
  unsigned gyro_divider = 1u + c->bank[2][GYRO_SMPLRT_DIV];
  unsigned accel_divider = 1u + ((c->bank[2][ACCEL_SMPLRT_DIV_1] & 0x0Fu) << 8) + c->bank[2][ACCEL_SMPLRT_DIV_2];
  bool gyro = c->samples % gyro_divider == 0 && (c->bank[0][PWR_MGMT_2] & 0x07) != 0x07;
  bool accel = c->samples % accel_divider == 0 && (c->bank[0][PWR_MGMT_2] & 0x38) != 0x38;
  if (c->frozen) return false;
  if (accel && since_wake_ns >= ACCEL_START_NS) {
    double lsb_per_mps2 = 16384.0 / (1 << ((c->bank[2][ACCEL_CONFIG] >> 1) & 3)) / GRAVITY;
    for (int axis = 0; axis < 3; ++axis)
      put_word(c, (uint8_t)(ACCEL_XOUT_H + 2 * axis), c->filtered[axis] * lsb_per_mps2);
  }
  if (gyro && since_wake_ns >= GYRO_START_NS) {
    static const double LSB_PER_DPS[4] = {131, 65.5, 32.8, 16.4};
    double lsb_per_rps = LSB_PER_DPS[(c->bank[2][GYRO_CONFIG_1] >> 1) & 3] * 180 / M_PI;
    for (int axis = 0; axis < 3; ++axis)
      put_word(c, (uint8_t)(GYRO_XOUT_H + 2 * axis), c->filtered[axis + 3] * lsb_per_rps);
  }
  if (gyro || accel) {
    put_word(c, TEMP_OUT_H, (r->imu_temperature_c - 21) * 333.87);
    c->bank[0][INT_STATUS_1] |= 1;
  }
  return gyro || accel;
}

/* A transfer of the I2C master, slaves 0 to 3 (sections 11.4 to 11.19); returns the bytes put into the external sensor
 * data registers. */
static int serve_slave(icm20948 *c, int slave, int filled, uint64_t now_ns) {
  const uint8_t *r = &c->bank[3][I2C_SLV0_ADDR + 4 * slave];
  uint8_t address = r[0], reg = r[1], control = r[2], output = r[3];
  if (!(control & SLV_EN)) return 0;
  bool answers = (address & 0x7F) == AK09916_ADDRESS;
  if (!answers) c->bank[0][I2C_MST_STATUS] |= (uint8_t)(1 << slave);
  if (!(address & SLV_READ)) {
    if (answers && !(control & SLV_REG_DIS)) ak09916_write(&c->compass, reg, output, now_ns);
    return 0;
  }
  int count = control & 0x0F;
  for (int i = 0; i < count && filled + i <= EXT_SLV_SENS_DATA_23 - EXT_SLV_SENS_DATA_00; ++i) {
    if (answers) c->bank[0][EXT_SLV_SENS_DATA_00 + filled + i] = ak09916_read(&c->compass, reg);
    reg = ak09916_next(reg);
  }
  return count;
}

/* The single transfer of slave 4 (sections 11.20 to 11.24). */
static void serve_slave4(icm20948 *c, uint64_t now_ns) {
  uint8_t *r = c->bank[3];
  if (!(r[I2C_SLV4_CTRL] & SLV_EN)) return;
  if ((r[I2C_SLV4_ADDR] & 0x7F) != AK09916_ADDRESS)
    c->bank[0][I2C_MST_STATUS] |= SLV4_NACK;
  else if (r[I2C_SLV4_ADDR] & SLV_READ)
    r[I2C_SLV4_DI] = ak09916_read(&c->compass, r[I2C_SLV4_REG]);
  else
    ak09916_write(&c->compass, r[I2C_SLV4_REG], r[I2C_SLV4_DO], now_ns);
  r[I2C_SLV4_CTRL] &= (uint8_t)~SLV_EN;
  c->bank[0][I2C_MST_STATUS] |= SLV4_DONE;
}

static void run_i2c_master(icm20948 *c, uint64_t now_ns) {
  if (!(c->bank[0][USER_CTRL] & I2C_MST_EN)) return;
  int filled = 0;
  for (int slave = 0; slave < 4; ++slave) filled += serve_slave(c, slave, filled, now_ns);
  serve_slave4(c, now_ns);
}

void icm20948_run_until(icm20948 *c, const mcu_readings *readings, uint64_t now_ns) {
  while (awake(c)) {
    uint64_t since_wake_ns = (c->samples + 1) * 8000000 / 9; /* 1125 Hz */
    uint64_t sample_ns = c->awake_ns + since_wake_ns;
    if (sample_ns > now_ns) break;
    c->samples++;
    ak09916_run_until(&c->compass, readings->field_ut, sample_ns);
    filter(c, readings);
    if (latch(c, readings, since_wake_ns)) run_i2c_master(c, sample_ns);
  }
  ak09916_run_until(&c->compass, readings->field_ut, now_ns);
}

static void write_register(icm20948 *c, uint8_t address, uint8_t value, uint64_t now_ns) {
  if (address == REG_BANK_SEL) {
    c->selected_bank = (value >> 4) & 3;
    return;
  }
  bool read_only =
      c->selected_bank == 0 && (address == WHO_AM_I || (address >= I2C_MST_STATUS && address <= EXT_SLV_SENS_DATA_23));
  if (read_only) return;
  bool was_awake = awake(c);
  c->bank[c->selected_bank][address] = value;
  if (c->selected_bank != 0 || address != PWR_MGMT_1) return;
  if (value & DEVICE_RESET) reset_registers(c, now_ns);
  if (!was_awake && awake(c)) {
    c->awake_ns = now_ns;
    c->samples = 0;
  }
}

static uint8_t read_register(icm20948 *c, uint8_t address) {
  if (address == REG_BANK_SEL) return (uint8_t)(c->selected_bank << 4);
  uint8_t value = c->bank[c->selected_bank][address];
  bool clears_on_read = c->selected_bank == 0 && (address == I2C_MST_STATUS || address == INT_STATUS_1);
  if (clears_on_read) c->bank[0][address] = 0;
  return value;
}

void icm20948_select(icm20948 *c, bool selected) {
  c->in_transfer = selected;
  c->address_taken = false;
}

uint8_t icm20948_exchange(icm20948 *c, uint8_t in, uint64_t now_ns) {
  if (!c->in_transfer || now_ns < c->ready_ns) return 0;
  if (!c->address_taken) {
    c->address_taken = true;
    c->is_read = in & 0x80;
    c->address = in & 0x7F;
    return 0;
  }
  uint8_t out = 0;
  if (c->is_read)
    out = read_register(c, c->address);
  else
    write_register(c, c->address, in, now_ns);
  if (c->address != REG_BANK_SEL) c->address++;
  return out;
}
