/* Forces of water, weight, fins and propeller on the hull, and the drive that turns the propeller. */
#pragma once

#include "hull.h"

/* Velocity of the hull through the water and its attitude: all that hydrodynamics knows. */
typedef struct hull_motion {
  double depth_m; /* of the origin */
  double down[3]; /* the mission frame's down in body axes */
  double nu[6];   /* relative linear and angular velocity, body axes */
  double servo_rad[HULL_SERVOS];
  double propeller_rps;
} hull_motion;

typedef struct hull_drive {
  double torque_nm; /* of the motor on the shaft */
  double battery_v;
  double battery_a;
} hull_drive;

/* Every generalised force (X Y Z K M N) about the origin but the inertial ones; gives the shaft its load back. */
void hull_forces(const hull_parameters *p, const hull_motion *motion, double force[6], double *shaft_load_nm);

/* What motor and battery do at this throttle, shaft speed and charge. */
hull_drive hull_drive_at(const hull_parameters *p, double throttle, double shaft_rps, double charge);
