/* A fleet of simulated vehicles in lockstep: hull, sensors and microcontroller of each.
 * Python reads this very file through cffi, so it holds plain declarations only. */
#pragma once

#include "../mcu/mcu.h"
#include "hull.h"
#include "sensors.h"

/* One vehicle as the world sees it. Mission frame: north, east, down; body frame: forward, right, down. */
typedef struct plant_vehicle {
  /* Written by the plant. */
  hull_state hull;
  double pulse_us[3]; /* bow, stern, motor: last complete pulse */
  double travelled_m; /* path length over ground since creation */
  mcu_counters counters;

  /* Written by the world between runs. */
  double current_ned_mps[3]; /* of the water around this vehicle */
} plant_vehicle;

typedef struct plant_config {
  const char *image; /* ELF for the `avr` make; unused for `native` and `null` */
  int vehicles;
  int threads;
  uint64_t seed;
  uint32_t baud;
  uint32_t step_us;             /* of the hull, sensors and microcontroller */
  const hull_parameters *hulls; /* one a vehicle */
  sensor_parameters sensors;
} plant_config;

typedef struct plant plant;

/* A number that changes when the size of a shared structure does: the caller's declarations must be the library's. */
uint64_t plant_layout(void);

/* Makes the fleet at time 0 from its starting states; NULL with a cause in `error` when it cannot. */
plant *plant_create(const plant_config *config, const hull_state *starts, char *error, size_t error_size);
void plant_destroy(plant *p);

/* Sends the other threads to run every vehicle until the absolute time, rounded down to a whole step, and returns at
 * once. Until plant_finish nothing else may be asked of the plant. */
void plant_start(plant *p, uint64_t time_us);
/* Helps them to the end; 0, or the 1-based number of the first vehicle that has failed. A failed vehicle stays where it
 * is, the others run on. */
int plant_finish(plant *p);
uint64_t plant_time_us(const plant *p);
/* Why a vehicle failed; empty while it runs. Vehicles count from 0 here and below. */
const char *plant_failure(const plant *p, int vehicle);

plant_vehicle *plant_get_vehicle(plant *p, int vehicle);
mcu_faults *plant_get_faults(plant *p, int vehicle);
sensor_faults *plant_get_sensor_faults(plant *p, int vehicle);
const mcu_readings *plant_get_readings(plant *p, int vehicle);
size_t plant_uart_write(plant *p, int vehicle, int port, const uint8_t *bytes, size_t count, uint64_t not_before_us);
size_t plant_uart_read(plant *p, int vehicle, int port, uint8_t *bytes, size_t capacity);
void plant_eeprom_read(plant *p, int vehicle, uint8_t bytes[MCU_EEPROM_BYTES]);
void plant_power_cycle(plant *p, int vehicle);
