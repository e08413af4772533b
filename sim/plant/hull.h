/* Six-degree-of-freedom dynamics of a small torpedo-like vehicle after Fossen, Handbook of Marine Craft
 * Hydrodynamics and Motion Control (2021), chapters 3, 6 to 8 and 10.
 * Mission frame: north, east, down; body frame: forward, right, down, its origin amidships on the axis.
 * Python reads this very file through cffi, so it holds plain declarations only. */
#pragma once

enum { HULL_STRIPS = 24, HULL_FINS = 8, HULL_SERVOS = 2, HULL_CHARGE_POINTS = 11 };

/* A slice of the hull across its axis: cross-flow drag and buoyancy act slice by slice. */
typedef struct hull_strip {
  double x_m;
  double length_m;
  double diameter_m;
  double buoyancy_share; /* the shares of all slices sum to 1 */
  double buoyancy_x_m;   /* so placed that the slices' centre is the centre of buoyancy */
} hull_strip;

/* A fin as a plate with a normal force; fixed fins have servo -1. */
typedef struct hull_fin {
  double position_m[3];
  double normal[3]; /* unit, across the x axis; positive deflection turns the trailing edge this way */
  double area_m2;
  double span_m;        /* the depth over which it leaves the water */
  double slope_per_rad; /* of the normal force before stall */
  double stall_start;   /* sine of the angle of attack where the flow begins to part */
  double stall_end;     /* and where it has parted */
  double broadside;     /* normal force coefficient at 90 degrees */
  double profile_drag;
  double flow_straightening; /* share of the local cross velocity that the fin sees */
  double wash_share;         /* share of its area inside the propeller's race */
  double gain;               /* deflection per servo angle */
  int servo;
} hull_fin;

typedef struct hull_propeller {
  double position_m[3];
  double diameter_m;
  double kt0, kt1; /* K_T = kt0 + kt1 J */
  double kq0, kq1; /* K_Q = kq0 + kq1 J */
  double astern;   /* thrust and torque turning astern over those ahead, at J = 0 */
  double wake_fraction;
  double thrust_deduction;
  double torque_share; /* of the propeller's torque that rolls the hull; the rest the stern recovers */
} hull_propeller;

/* A motor behind an ESC that drives but does not brake. */
typedef struct hull_motor {
  double constant_vs; /* volts per rad/s and newton metres per ampere, at the propeller shaft */
  double resistance_ohm;
  double inertia_kgm2; /* rotor, shaft, propeller and entrained water, at the shaft */
  double friction_nm;
  double current_limit_a;
  double neutral_us, span_us, dead_us; /* pulse width at rest, from rest to full, and without effect */
} hull_motor;

typedef struct hull_battery {
  double capacity_as;
  double resistance_ohm;
  double hotel_w;                            /* everything but the motor */
  double open_circuit_v[HULL_CHARGE_POINTS]; /* at evenly spaced charge from empty to full */
} hull_battery;

typedef struct hull_servo {
  double time_constant_s;
  double rate_rps;
  double limit_rad;
  double neutral_us, rad_per_us;
} hull_servo;

typedef struct hull_parameters {
  double density_kgm3;
  double gravity_mps2;
  double weight_n;
  double buoyancy_n; /* wholly submerged */
  double centre_of_gravity_m[3];
  double centre_of_buoyancy_m[3];
  double rigid_body[6][6];   /* M_RB about the origin */
  double added_mass[6][6];   /* M_A about the origin */
  double mass_inverse[6][6]; /* (M_RB + M_A)^-1 */
  double munk; /* share kept of the added-mass Coriolis forces in pitch and yaw, the Munk moment among them */
  double linear_damping[6]; /* at rest, N s/m and N m s */
  double damping_decay[6];  /* s/m: the linear damping fades with speed as exp(-decay U) */
  double quadratic_damping[6];
  double crossflow_drag[2]; /* two-dimensional coefficient, lateral and vertical */
  double lift_area_m2[2];   /* body lift: slope times reference area, lateral and vertical */
  double lift_x_m;          /* where it acts */
  double induced_drag;      /* 1 / (pi e AR S), 1/m2 */
  hull_strip strips[HULL_STRIPS];
  int strip_count;
  hull_fin fins[HULL_FINS];
  int fin_count;
  hull_propeller propeller;
  hull_motor motor;
  hull_battery battery;
  hull_servo servo;
} hull_parameters;

typedef struct hull_state {
  double position_m[3];   /* mission frame */
  double quaternion[4];   /* body to mission, scalar first */
  double velocity_mps[3]; /* over ground, body frame */
  double rate_rps[3];     /* body frame */
  double servo_rad[HULL_SERVOS];
  double propeller_rps; /* radians per second */
  double charge;        /* 0 empty to 1 full */
  /* Of the last step. */
  double battery_v;
  double battery_a;
  double acceleration_mps2[3]; /* of the origin against inertial space, body axes, mean over the step */
  double angular_acceleration_rps2[3];
} hull_state;

typedef struct hull_input {
  double servo_rad[HULL_SERVOS]; /* commanded */
  double throttle;               /* -1 full astern to 1 full ahead */
  double current_ned_mps[3];     /* of the water, uniform around the vehicle and steady over the step */
} hull_input;

/* The state after `dt` seconds. */
hull_state hull_step(const hull_parameters *parameters, const hull_state *state, const hull_input *input, double dt);

/* At rest at a position and heading, with a charged battery and neutral fins. */
hull_state hull_at_rest(const hull_parameters *parameters, const double position_m[3], double heading_rad);

/* Turns pulse widths (bow, stern, motor; 0 where none came) into commands; a servo without pulses keeps its last one.
 */
void hull_command(const hull_parameters *parameters, const double pulse_us[3], hull_input *input);

/* `rotated` = v from body to mission frame, and back. */
void hull_to_mission(const double quaternion[4], const double body[3], double mission[3]);
void hull_to_body(const double quaternion[4], const double mission[3], double body[3]);
