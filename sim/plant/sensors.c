/* What the vehicle's sensor chips are exposed to: truth, bias and noise of each. */
#include "sensors.h"

#include <math.h>

static void cross(const double a[3], const double b[3], double out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static double draw_bias(const sensor_error *error, random_source *random) {
  return error->bias_sigma * random_normal(random);
}

void sensors_start(const sensor_parameters *parameters, uint64_t seed, uint64_t vehicle, sensor_state *state) {
  random_source *random = &state->random;
  random_seed(random, seed, vehicle);
  for (int i = 0; i < 3; i++) {
    state->accelerometer_bias[i] = draw_bias(&parameters->accelerometer, random);
    state->gyro_bias[i] = draw_bias(&parameters->gyro, random);
    state->magnetometer_bias[i] = draw_bias(&parameters->magnetometer, random);
  }
  state->pressure_bias = draw_bias(&parameters->pressure, random);
  state->imu_temperature_bias = draw_bias(&parameters->imu_temperature, random);
  state->water_temperature_bias = draw_bias(&parameters->water_temperature, random);
  state->voltage_bias = draw_bias(&parameters->voltage, random);
  state->current_bias = draw_bias(&parameters->current, random);
}

/* Truth with its errors. White noise of a one-sided density, held for dt, spreads over the band up to 1 / (2 dt). */
static double measure(const sensor_error *error, double truth, double dt, random_source *random, double *bias) {
  if (error->bias_walk > 0.0) *bias += error->bias_walk * sqrt(dt) * random_normal(random);
  const double variance = error->noise_density * error->noise_density * 0.5 / dt + error->noise_rms * error->noise_rms;
  return truth + *bias + (variance > 0.0 ? sqrt(variance) * random_normal(random) : 0.0);
}

/* Specific force at the IMU: acceleration of that point less gravity, body axes. */
static void specific_force(const sensor_parameters *parameters, const hull_parameters *hull, const hull_state *truth,
                           double out[3]) {
  const double gravity_ned[3] = {0.0, 0.0, hull->gravity_mps2};
  double gravity[3], tangential[3], spin[3], centripetal[3];
  hull_to_body(truth->quaternion, gravity_ned, gravity);
  cross(truth->angular_acceleration_rps2, parameters->imu_position_m, tangential);
  cross(truth->rate_rps, parameters->imu_position_m, spin);
  cross(truth->rate_rps, spin, centripetal);
  for (int i = 0; i < 3; i++) out[i] = truth->acceleration_mps2[i] + tangential[i] + centripetal[i] - gravity[i];
}

/* Absolute pressure at the depth sensor; in air that of the atmosphere. */
static double pressure_at(const sensor_parameters *parameters, const hull_parameters *hull, const hull_state *truth) {
  double offset[3];
  hull_to_mission(truth->quaternion, parameters->pressure_position_m, offset);
  const double depth = truth->position_m[2] + offset[2];
  return parameters->atmosphere_pa + (depth > 0.0 ? hull->density_kgm3 * hull->gravity_mps2 * depth : 0.0);
}

void sensors_step(const sensor_parameters *parameters, const hull_parameters *hull, const sensor_faults *faults,
                  const hull_state *truth, double dt, sensor_state *state, mcu_readings *readings) {
  random_source *random = &state->random;
  double force[3], field[3];
  specific_force(parameters, hull, truth, force);
  hull_to_body(truth->quaternion, parameters->field_ned_ut, field);
  for (int i = 0; i < 3; i++) {
    readings->specific_force_mps2[i] =
        measure(&parameters->accelerometer, force[i] + faults->accelerometer_bias_mps2[i], dt, random,
                &state->accelerometer_bias[i]);
    readings->rate_rps[i] =
        measure(&parameters->gyro, truth->rate_rps[i] + faults->gyro_bias_rps[i], dt, random, &state->gyro_bias[i]);
    readings->field_ut[i] = measure(&parameters->magnetometer, field[i] + faults->compass_disturbance_ut[i], dt, random,
                                    &state->magnetometer_bias[i]);
  }
  readings->pressure_pa =
      measure(&parameters->pressure, pressure_at(parameters, hull, truth) + faults->pressure_offset_pa, dt, random,
              &state->pressure_bias);
  readings->imu_temperature_c =
      measure(&parameters->imu_temperature, parameters->water_temperature_c + parameters->imu_heating_c, dt, random,
              &state->imu_temperature_bias);
  readings->water_temperature_c = measure(&parameters->water_temperature, parameters->water_temperature_c, dt, random,
                                          &state->water_temperature_bias);
  const double voltage =
      measure(&parameters->voltage, truth->battery_v - faults->battery_drop_v, dt, random, &state->voltage_bias);
  const double current = measure(&parameters->current, truth->battery_a, dt, random, &state->current_bias);
  readings->battery_v = voltage > 0.0 ? voltage : 0.0;
  readings->battery_a = current > 0.0 ? current : 0.0;
  readings->leak = faults->leak;
}
