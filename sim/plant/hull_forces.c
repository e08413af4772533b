/* Forces of water, weight, fins and propeller on the hull, and the drive that turns the propeller. */
#include "hull_forces.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

/* Never outside the limits, whatever x is: NaN gives `low`. */
static double clamp(double x, double low, double high) { return x > low ? (x < high ? x : high) : low; }

/* 0 to 1 with level ends. */
static double smoothstep(double x) {
  x = clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

/* Share under water of something `height` tall whose middle is `depth` deep. */
static double submerged(double depth, double height) { return smoothstep(0.5 + depth / height); }

static double depth_at(const hull_motion *m, const double r[3]) {
  return m->depth_m + m->down[0] * r[0] + m->down[1] * r[1] + m->down[2] * r[2];
}

static void add_at(const double r[3], const double f[3], double force[6]) {
  force[0] += f[0];
  force[1] += f[1];
  force[2] += f[2];
  force[3] += r[1] * f[2] - r[2] * f[1];
  force[4] += r[2] * f[0] - r[0] * f[2];
  force[5] += r[0] * f[1] - r[1] * f[0];
}

/* Fossen 2021, eq. 4.6, with each slice's buoyancy shrinking as it leaves the water. */
static void add_weight_and_buoyancy(const hull_parameters *p, const hull_motion *m, double force[6]) {
  double f[3];
  for (int i = 0; i < 3; i++) f[i] = p->weight_n * m->down[i];
  add_at(p->centre_of_gravity_m, f, force);
  for (int s = 0; s < p->strip_count; s++) {
    const hull_strip *strip = &p->strips[s];
    const double r[3] = {strip->buoyancy_x_m, p->centre_of_buoyancy_m[1], p->centre_of_buoyancy_m[2]};
    const double lift = p->buoyancy_n * strip->buoyancy_share * submerged(depth_at(m, r), strip->diameter_m);
    for (int i = 0; i < 3; i++) f[i] = -lift * m->down[i];
    add_at(r, f, force);
  }
}

/* Linear damping that fades with speed (Fossen 2021, sec. 6.4.3 and 8.4.2) and quadratic damping, each axis alone. */
static void add_damping(const hull_parameters *p, const hull_motion *m, double speed, double force[6]) {
  for (int i = 0; i < 6; i++) {
    const double fade = p->damping_decay[i] > 0.0 ? exp(-p->damping_decay[i] * speed) : 1.0;
    force[i] -= (p->linear_damping[i] * fade + p->quadratic_damping[i] * fabs(m->nu[i])) * m->nu[i];
  }
}

/* Cross-flow drag by strip theory, Fossen 2021, eq. 6.91 and 6.92 in both planes at once. */
static void add_crossflow(const hull_parameters *p, const hull_motion *m, double force[6]) {
  for (int s = 0; s < p->strip_count; s++) {
    const hull_strip *strip = &p->strips[s];
    const double v = m->nu[1] + strip->x_m * m->nu[5];
    const double w = m->nu[2] - strip->x_m * m->nu[4];
    const double q = 0.5 * p->density_kgm3 * strip->diameter_m * strip->length_m * sqrt(v * v + w * w);
    const double y = -q * p->crossflow_drag[0] * v;
    const double z = -q * p->crossflow_drag[1] * w;
    force[1] += y;
    force[2] += z;
    force[4] -= strip->x_m * z;
    force[5] += strip->x_m * y;
  }
}

/* Lift of the bare hull with slope sin(a) cos(a), square to the velocity, and the drag it induces (Fossen 2021,
 * sec. 8.4.2; Prestero 2001, sec. 4.4); lift does no work, induced drag only takes. */
static void add_body_lift(const hull_parameters *p, const hull_motion *m, double speed, double force[6]) {
  if (speed < 1e-9) return;
  const double u = m->nu[0];
  double f[3] = {0.0, 0.0, 0.0};
  double lift_area_squared = 0.0; /* (C_L S)^2 */
  for (int plane = 0; plane < 2; plane++) {
    const double cross = m->nu[1 + plane];
    const double q = 0.5 * p->density_kgm3 * p->lift_area_m2[plane] * u * cross / speed;
    f[0] += q * cross;
    f[1 + plane] -= q * u;
    const double lift_area = p->lift_area_m2[plane] * u * cross / (speed * speed);
    lift_area_squared += lift_area * lift_area;
  }
  const double drag = 0.5 * p->density_kgm3 * p->induced_drag * lift_area_squared * speed;
  for (int i = 0; i < 3; i++) f[i] -= drag * m->nu[i];
  const double r[3] = {p->lift_x_m, 0.0, 0.0};
  add_at(r, f, force);
}

/* Normal force coefficient over the sine of the angle of attack: linear, then stalled as a flat plate (Hoerner 1965,
 * Fluid-Dynamic Drag, p. 3-16). */
static double normal_coefficient(const hull_fin *fin, double sine) {
  const double size = fabs(sine);
  const double parted = smoothstep((size - fin->stall_start) / (fin->stall_end - fin->stall_start));
  const double attached = fin->slope_per_rad * sine;
  const double plate = fin->broadside * sine / (0.56 + 0.44 * size);
  return attached + parted * (plate - attached);
}

/* Adds `area` of a deflected fin in a flow of axial speed u and cross speed v along the fin's normal: the rudder force
 * of Fossen 2021, eq. 9.118 to 9.121, as a force on the chord and across it. */
static void add_plate(const hull_parameters *p, const hull_fin *fin, double area, double deflection, double u, double v,
                      double along[2]) {
  const double c = cos(deflection), s = sin(deflection);
  const double chordwise = u * c - v * s, normal = u * s + v * c;
  const double speed = sqrt(u * u + v * v);
  if (speed < 1e-9) return;
  const double q = 0.5 * p->density_kgm3 * area * speed;
  const double across = -q * speed * normal_coefficient(fin, normal / speed);
  const double drag = -q * fin->profile_drag * chordwise;
  along[0] += across * s + drag * c;
  along[1] += across * c - drag * s;
}

static void add_fin(const hull_parameters *p, const hull_motion *m, const hull_fin *fin, double race_mps,
                    double force[6]) {
  const double wet = submerged(depth_at(m, fin->position_m), fin->span_m) * fin->area_m2;
  if (wet <= 0.0) return;
  const double *r = fin->position_m, *nu = m->nu, *n = fin->normal;
  const double u = nu[0] + nu[4] * r[2] - nu[5] * r[1];
  const double y = nu[1] + nu[5] * r[0] - nu[3] * r[2];
  const double z = nu[2] + nu[3] * r[1] - nu[4] * r[0];
  const double v = fin->flow_straightening * (y * n[1] + z * n[2]);
  const double deflection = fin->servo < 0 ? 0.0 : fin->gain * m->servo_rad[fin->servo];
  double along[2] = {0.0, 0.0};
  const double washed = race_mps > 0.0 ? fin->wash_share : 0.0;
  if (washed < 1.0) add_plate(p, fin, wet * (1.0 - washed), deflection, u, v, along);
  if (washed > 0.0) add_plate(p, fin, wet * washed, deflection, u + race_mps, v, along);
  const double f[3] = {along[0], along[1] * n[1], along[1] * n[2]};
  add_at(r, f, force);
}

/* Thrust and torque linear in the advance number (Fossen 2021, eq. 9.8 to 9.11) in all four quadrants; returns what
 * the race adds to the speed of the water astern of the disc, by momentum theory. */
static double add_propeller(const hull_parameters *p, const hull_motion *m, double force[6], double *shaft_load_nm) {
  const hull_propeller *screw = &p->propeller;
  const double d = screw->diameter_m;
  const double n = m->propeller_rps / (2.0 * pi);
  const double advance = (1.0 - screw->wake_fraction) * m->nu[0];
  const double strength = p->density_kgm3 * d * d * d * d * fabs(n) * submerged(depth_at(m, screw->position_m), d);
  const double own = n >= 0.0 ? n : screw->astern * n;
  const double thrust = strength * (screw->kt0 * own + screw->kt1 * advance / d);
  const double torque = strength * d * (screw->kq0 * own + screw->kq1 * advance / d);
  *shaft_load_nm = torque;
  const double f[3] = {(1.0 - screw->thrust_deduction) * thrust, 0.0, 0.0};
  add_at(screw->position_m, f, force);
  force[3] += screw->torque_share * torque;
  if (thrust <= 0.0 || n <= 0.0) return 0.0;
  const double inflow = advance > 0.0 ? advance : 0.0;
  return sqrt(inflow * inflow + 8.0 * thrust / (p->density_kgm3 * pi * d * d)) - inflow;
}

void hull_forces(const hull_parameters *p, const hull_motion *motion, double force[6], double *shaft_load_nm) {
  const double *nu = motion->nu;
  const double speed = sqrt(nu[0] * nu[0] + nu[1] * nu[1] + nu[2] * nu[2]);
  for (int i = 0; i < 6; i++) force[i] = 0.0;
  add_weight_and_buoyancy(p, motion, force);
  add_damping(p, motion, speed, force);
  add_crossflow(p, motion, force);
  add_body_lift(p, motion, speed, force);
  const double race_mps = add_propeller(p, motion, force, shaft_load_nm);
  for (int i = 0; i < p->fin_count; i++) add_fin(p, motion, &p->fins[i], race_mps, force);
}

static double open_circuit_v(const hull_battery *battery, double charge) {
  const double place = clamp(charge, 0.0, 1.0) * (HULL_CHARGE_POINTS - 1);
  int below = (int)place;
  if (below > HULL_CHARGE_POINTS - 2) below = HULL_CHARGE_POINTS - 2;
  const double *v = &battery->open_circuit_v[below];
  return v[0] + (v[1] - v[0]) * (place - below);
}

/* A chopper gives the motor `throttle` of the battery's voltage and takes `throttle` of its current, so that with
 * battery resistance R_b and motor resistance R: i = (d (E - R_b I_hotel) - k w) / (R + d^2 R_b). */
hull_drive hull_drive_at(const hull_parameters *p, double throttle, double shaft_rps, double charge) {
  const hull_motor *motor = &p->motor;
  const hull_battery *battery = &p->battery;
  hull_drive drive = {0.0, 0.0, 0.0};
  if (charge <= 0.0) return drive;
  const double source_v = open_circuit_v(battery, charge);
  const double hotel_a = battery->hotel_w / source_v;
  const double emf = motor->constant_vs * shaft_rps;
  double motor_a = (throttle * (source_v - battery->resistance_ohm * hotel_a) - emf) /
                   (motor->resistance_ohm + throttle * throttle * battery->resistance_ohm);
  motor_a = throttle > 0.0 ? clamp(motor_a, 0.0, motor->current_limit_a)
                           : clamp(motor_a, throttle < 0.0 ? -motor->current_limit_a : 0.0, 0.0);
  drive.torque_nm = motor->constant_vs * motor_a;
  drive.battery_a = hotel_a + throttle * motor_a;
  drive.battery_v = source_v - battery->resistance_ohm * drive.battery_a;
  return drive;
}
