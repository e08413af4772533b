/* What the vehicle's sensor chips are exposed to: truth, bias and noise of each. Filters, conversion times and
 * resolution belong to the chips, which stand behind mcu.h.
 * Python reads this very file through cffi, so it holds plain declarations only. */
#pragma once

#include "../mcu/mcu.h"
#include "hull.h"
#include "random.h"

/* Errors of one kind of channel, in its unit. */
typedef struct sensor_error {
  double noise_density; /* white, one-sided, unit per root hertz */
  double noise_rms;     /* of every conversion */
  double bias_sigma;    /* of the constant bias drawn for each vehicle and axis */
  double bias_walk;     /* unit per root second */
} sensor_error;

typedef struct sensor_parameters {
  sensor_error accelerometer;                      /* m/s2 */
  sensor_error gyro;                               /* rad/s */
  sensor_error magnetometer;                       /* microtesla */
  sensor_error pressure;                           /* pascal */
  sensor_error imu_temperature, water_temperature; /* degrees Celsius */
  sensor_error voltage, current;                   /* volt, ampere */
  double imu_position_m[3];
  double pressure_position_m[3];
  double atmosphere_pa;
  double field_ned_ut[3]; /* of the earth */
  double water_temperature_c;
  double imu_heating_c; /* its own warmth above the water's */
} sensor_parameters;

/* Faults of the sensed world; all zero is a healthy vehicle. */
typedef struct sensor_faults {
  double compass_disturbance_ut[3]; /* body axes */
  double gyro_bias_rps[3];
  double accelerometer_bias_mps2[3];
  double pressure_offset_pa;
  double battery_drop_v;
  int leak;
} sensor_faults;

/* Biases of one vehicle as they have walked so far. */
typedef struct sensor_state {
  random_source random;
  double accelerometer_bias[3], gyro_bias[3], magnetometer_bias[3];
  double pressure_bias, imu_temperature_bias, water_temperature_bias, voltage_bias, current_bias;
} sensor_state;

/* Draws the biases of one vehicle. */
void sensors_start(const sensor_parameters *parameters, uint64_t seed, uint64_t vehicle, sensor_state *state);

/* Advances the biases by `dt` and writes what the chips are exposed to during the next `dt`. */
void sensors_step(const sensor_parameters *parameters, const hull_parameters *hull, const sensor_faults *faults,
                  const hull_state *truth, double dt, sensor_state *state, mcu_readings *readings);
