/* Equations of motion of the hull and their integration. */
#include "hull.h"

#include <math.h>

#include "hull_forces.h"

/* Order of the states that are integrated; velocity is relative to the water, so a steady current drops out exactly. */
enum { POSITION = 0, QUATERNION = 3, VELOCITY = 7, RATE = 10, SERVO = 13, SHAFT = 15, CHARGE = 16, STATES = 17 };

static double clamp(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

static void cross(const double a[3], const double b[3], double out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Rotates by a unit quaternion whose vector part has the given sign. */
static void rotate(const double q[4], double sign, const double v[3], double out[3]) {
  const double axis[3] = {sign * q[1], sign * q[2], sign * q[3]};
  double t[3], u[3];
  cross(axis, v, t);
  for (int i = 0; i < 3; i++) t[i] *= 2.0;
  cross(axis, t, u);
  for (int i = 0; i < 3; i++) out[i] = v[i] + q[0] * t[i] + u[i];
}

void hull_to_mission(const double quaternion[4], const double body[3], double mission[3]) {
  rotate(quaternion, 1.0, body, mission);
}

void hull_to_body(const double quaternion[4], const double mission[3], double body[3]) {
  rotate(quaternion, -1.0, mission, body);
}

/* Subtracts C(nu) nu, Fossen 2021, eq. 3.60 (Kirchhoff): `turning` scales the terms in pitch and yaw, in pairs so that
 * the forces stay without work. */
static void subtract_coriolis(const double mass[6][6], const double nu[6], double turning, double force[6]) {
  double momentum[6];
  for (int i = 0; i < 6; i++) {
    momentum[i] = 0.0;
    for (int j = 0; j < 6; j++) momentum[i] += mass[i][j] * nu[j];
  }
  const double *l = momentum, *v = nu, *w = nu + 3;
  force[0] += turning * (l[1] * w[2] - l[2] * w[1]);
  force[1] += l[2] * w[0] - turning * l[0] * w[2];
  force[2] += turning * l[0] * w[1] - l[1] * w[0];
  double spin[3];
  cross(w, momentum + 3, spin);
  force[3] -= v[1] * l[2] - v[2] * l[1] + spin[0];
  force[4] -= turning * (v[2] * l[0] - v[0] * l[2]) + spin[1];
  force[5] -= turning * (v[0] * l[1] - v[1] * l[0]) + spin[2];
}

/* (M_RB + M_A) nu' = tau - C_RB(nu) nu - C_A(nu) nu in the velocity relative to the water, Fossen 2021, eq. 10.149. */
static void accelerate(const hull_parameters *p, const hull_motion *motion, double acceleration[6],
                       double *shaft_load_nm) {
  double force[6];
  hull_forces(p, motion, force, shaft_load_nm);
  subtract_coriolis(p->rigid_body, motion->nu, 1.0, force);
  subtract_coriolis(p->added_mass, motion->nu, p->munk, force);
  for (int i = 0; i < 6; i++) {
    acceleration[i] = 0.0;
    for (int j = 0; j < 6; j++) acceleration[i] += p->mass_inverse[i][j] * force[j];
  }
}

/* Shaft friction that stops the shaft and never drives it, smooth through rest. */
static double friction_nm(const hull_motor *motor, double shaft_rps) {
  return motor->friction_nm * shaft_rps / (fabs(shaft_rps) + 1.0);
}

static void differentiate(const hull_parameters *p, const hull_input *input, const double x[STATES],
                          double dx[STATES]) {
  static const double down_ned[3] = {0.0, 0.0, 1.0};
  const double *q = x + QUATERNION, *v = x + VELOCITY, *w = x + RATE;
  hull_motion motion = {.depth_m = x[POSITION + 2], .propeller_rps = x[SHAFT]};
  hull_to_body(q, down_ned, motion.down);
  for (int i = 0; i < 3; i++) {
    motion.nu[i] = v[i];
    motion.nu[3 + i] = w[i];
  }
  for (int i = 0; i < HULL_SERVOS; i++) motion.servo_rad[i] = x[SERVO + i];

  double shaft_load_nm;
  accelerate(p, &motion, dx + VELOCITY, &shaft_load_nm);
  hull_to_mission(q, v, dx + POSITION);
  for (int i = 0; i < 3; i++) dx[POSITION + i] += input->current_ned_mps[i];
  dx[QUATERNION] = -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]);
  dx[QUATERNION + 1] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]);
  dx[QUATERNION + 2] = 0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]);
  dx[QUATERNION + 3] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]);

  const hull_servo *servo = &p->servo;
  for (int i = 0; i < HULL_SERVOS; i++) {
    const double goal = clamp(input->servo_rad[i], -servo->limit_rad, servo->limit_rad);
    dx[SERVO + i] = clamp((goal - x[SERVO + i]) / servo->time_constant_s, -servo->rate_rps, servo->rate_rps);
  }
  const hull_drive drive = hull_drive_at(p, input->throttle, x[SHAFT], x[CHARGE]);
  dx[SHAFT] = (drive.torque_nm - shaft_load_nm - friction_nm(&p->motor, x[SHAFT])) / p->motor.inertia_kgm2;
  dx[CHARGE] = x[CHARGE] > 0.0 ? -drive.battery_a / p->battery.capacity_as : 0.0;
}

static void pack(const hull_state *state, const double water_body[3], double x[STATES]) {
  for (int i = 0; i < 3; i++) {
    x[POSITION + i] = state->position_m[i];
    x[VELOCITY + i] = state->velocity_mps[i] - water_body[i];
    x[RATE + i] = state->rate_rps[i];
  }
  for (int i = 0; i < 4; i++) x[QUATERNION + i] = state->quaternion[i];
  for (int i = 0; i < HULL_SERVOS; i++) x[SERVO + i] = state->servo_rad[i];
  x[SHAFT] = state->propeller_rps;
  x[CHARGE] = state->charge;
}

/* Heun's method: two evaluations a step, second order. */
hull_state hull_step(const hull_parameters *parameters, const hull_state *state, const hull_input *input, double dt) {
  double water_body[3], x[STATES], first[STATES], second[STATES], ahead[STATES];
  hull_to_body(state->quaternion, input->current_ned_mps, water_body);
  pack(state, water_body, x);
  differentiate(parameters, input, x, first);
  for (int i = 0; i < STATES; i++) ahead[i] = x[i] + dt * first[i];
  differentiate(parameters, input, ahead, second);

  hull_state next;
  double mean[STATES], turning[3];
  for (int i = 0; i < STATES; i++) mean[i] = 0.5 * (first[i] + second[i]);
  cross(x + RATE, x + VELOCITY, turning);
  for (int i = 0; i < 3; i++) {
    next.acceleration_mps2[i] = mean[VELOCITY + i] + turning[i];
    next.angular_acceleration_rps2[i] = mean[RATE + i];
  }
  for (int i = 0; i < STATES; i++) x[i] += dt * mean[i];

  double *q = x + QUATERNION;
  const double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int i = 0; i < 4; i++) next.quaternion[i] = q[i] / norm;
  hull_to_body(next.quaternion, input->current_ned_mps, water_body);
  for (int i = 0; i < 3; i++) {
    next.position_m[i] = x[POSITION + i];
    next.velocity_mps[i] = x[VELOCITY + i] + water_body[i];
    next.rate_rps[i] = x[RATE + i];
  }
  for (int i = 0; i < HULL_SERVOS; i++) next.servo_rad[i] = x[SERVO + i];
  next.propeller_rps = x[SHAFT];
  next.charge = x[CHARGE] > 0.0 ? x[CHARGE] : 0.0;
  const hull_drive drive = hull_drive_at(parameters, input->throttle, next.propeller_rps, next.charge);
  next.battery_v = drive.battery_v;
  next.battery_a = drive.battery_a;
  return next;
}

hull_state hull_at_rest(const hull_parameters *parameters, const double position_m[3], double heading_rad) {
  hull_state state = {.charge = 1.0};
  for (int i = 0; i < 3; i++) state.position_m[i] = position_m[i];
  state.quaternion[0] = cos(0.5 * heading_rad);
  state.quaternion[3] = sin(0.5 * heading_rad);
  const hull_drive drive = hull_drive_at(parameters, 0.0, 0.0, state.charge);
  state.battery_v = drive.battery_v;
  state.battery_a = drive.battery_a;
  return state;
}

void hull_command(const hull_parameters *parameters, const double pulse_us[3], hull_input *input) {
  const hull_servo *servo = &parameters->servo;
  const hull_motor *motor = &parameters->motor;
  for (int i = 0; i < HULL_SERVOS; i++) {
    if (pulse_us[i] > 0.0) input->servo_rad[i] = (pulse_us[i] - servo->neutral_us) * servo->rad_per_us;
  }
  const double offset = pulse_us[2] > 0.0 ? pulse_us[2] - motor->neutral_us : 0.0;
  input->throttle = fabs(offset) <= motor->dead_us ? 0.0 : clamp(offset / motor->span_us, -1.0, 1.0);
}
