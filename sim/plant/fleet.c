/* Steps a fleet between two syncs: each vehicle runs alone, so the answer does not depend on the number of threads. */
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "plant.h"

enum { MAX_THREADS = 64, CAUSE_BYTES = 256 };

typedef struct member {
  plant_vehicle seen;
  hull_parameters hull;
  hull_input input;
  sensor_state sensors;
  sensor_faults faults;
  mcu *controller;
  uint64_t time_us;
  int failed;
  char cause[CAUSE_BYTES];
} member;

struct plant {
  sensor_parameters sensors;
  uint32_t step_us;
  int vehicles;
  member *members;
  uint64_t time_us;

  /* One round: `turn` counts it in, workers take members from `next`, `busy` counts workers out. */
  atomic_int next;
  pthread_mutex_t mutex;
  pthread_cond_t begin, end;
  pthread_t workers[MAX_THREADS];
  int worker_count;
  int busy;
  uint64_t turn;
  int closing;
};

uint64_t plant_layout(void) {
  const size_t sizes[] = {sizeof(plant_vehicle), sizeof(plant_config), sizeof(mcu_readings), sizeof(mcu_faults),
                          sizeof(sensor_faults)};
  uint64_t layout = 0;
  for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) layout = layout * 4093 + sizes[i];
  return layout;
}

static void fail(member *m, const char *cause) {
  m->failed = 1;
  snprintf(m->cause, sizeof m->cause, "%.4f s: %s", (double)m->time_us * 1e-6, cause);
}

/* One step of one vehicle; the microcontroller sees the readings of its beginning, the hull the pulses of its end. */
static void step_member(const plant *p, member *m) {
  const double dt = (double)p->step_us * 1e-6;
  if (mcu_run_until(m->controller, m->time_us + p->step_us) != 0) {
    fail(m, mcu_failure(m->controller));
    return;
  }
  m->time_us += p->step_us;
  for (int i = 0; i < MCU_ACTUATORS; i++) m->seen.pulse_us[i] = mcu_pulse_us(m->controller, i);
  hull_command(&m->hull, m->seen.pulse_us, &m->input);
  const hull_state before = m->seen.hull;
  m->seen.hull = hull_step(&m->hull, &before, &m->input, dt);
  double square = 0.0;
  for (int i = 0; i < 3; i++) {
    const double moved = m->seen.hull.position_m[i] - before.position_m[i];
    square += moved * moved;
  }
  if (!isfinite(square)) {
    fail(m, "the hull's state is no longer finite; step_s is too long or a hull coefficient is wrong");
    return;
  }
  m->seen.travelled_m += sqrt(square);
  sensors_step(&p->sensors, &m->hull, &m->faults, &m->seen.hull, dt, &m->sensors, mcu_get_readings(m->controller));
}

static void run_members(plant *p) {
  for (int i; (i = atomic_fetch_add(&p->next, 1)) < p->vehicles;) {
    member *m = &p->members[i];
    memcpy(m->input.current_ned_mps, m->seen.current_ned_mps, sizeof m->input.current_ned_mps);
    while (!m->failed && m->time_us + p->step_us <= p->time_us) step_member(p, m);
    m->seen.counters = *mcu_get_counters(m->controller);
  }
}

static void *work(void *argument) {
  plant *p = argument;
  uint64_t done = 0;
  pthread_mutex_lock(&p->mutex);
  for (;;) {
    while (p->turn == done && !p->closing) pthread_cond_wait(&p->begin, &p->mutex);
    if (p->closing) break;
    done = p->turn;
    pthread_mutex_unlock(&p->mutex);
    run_members(p);
    pthread_mutex_lock(&p->mutex);
    if (--p->busy == 0) pthread_cond_signal(&p->end);
  }
  pthread_mutex_unlock(&p->mutex);
  return NULL;
}

static int start_member(plant *p, const plant_config *config, const hull_state *start, int i, char *error,
                        size_t size) {
  member *m = &p->members[i];
  m->hull = config->hulls[i];
  m->seen.hull = *start;
  random_source lines;
  random_seed(&lines, config->seed, UINT64_C(0x100000000) + (uint64_t)i);
  const mcu_config controller = {.image = config->image, .seed = random_bits(&lines), .baud = config->baud};
  char cause[CAUSE_BYTES] = "";
  m->controller = mcu_create(&controller, cause, sizeof cause);
  if (m->controller == NULL) {
    snprintf(error, size, "vehicle %d: %s", i + 1, cause);
    return 0;
  }
  for (int k = 0; k < HULL_SERVOS; k++) m->input.servo_rad[k] = start->servo_rad[k];
  sensors_start(&p->sensors, config->seed, (uint64_t)i, &m->sensors);
  sensors_step(&p->sensors, &m->hull, &m->faults, start, (double)p->step_us * 1e-6, &m->sensors,
               mcu_get_readings(m->controller));
  return 1;
}

plant *plant_create(const plant_config *config, const hull_state *starts, char *error, size_t error_size) {
  if (config->vehicles < 1 || config->threads < 1 || config->threads > MAX_THREADS || config->step_us < 1) {
    snprintf(error, error_size, "vehicles %d, threads %d, step_us %u: must be at least 1, threads at most %d",
             config->vehicles, config->threads, (unsigned)config->step_us, (int)MAX_THREADS);
    return NULL;
  }
  plant *p = calloc(1, sizeof *p);
  member *members = calloc((size_t)config->vehicles, sizeof *members);
  if (p == NULL || members == NULL) {
    snprintf(error, error_size, "no memory for %d vehicles", config->vehicles);
    free(members);
    free(p);
    return NULL;
  }
  p->members = members;
  p->sensors = config->sensors;
  p->step_us = config->step_us;
  p->vehicles = config->vehicles;
  pthread_mutex_init(&p->mutex, NULL);
  pthread_cond_init(&p->begin, NULL);
  pthread_cond_init(&p->end, NULL);
  for (int i = 0; i < config->vehicles; i++) {
    if (!start_member(p, config, &starts[i], i, error, error_size)) {
      plant_destroy(p);
      return NULL;
    }
  }
  for (int i = 0; i < config->threads - 1; i++) {
    if (pthread_create(&p->workers[i], NULL, work, p) != 0) {
      snprintf(error, error_size, "thread %d of %d could not be started", i + 2, config->threads);
      plant_destroy(p);
      return NULL;
    }
    p->worker_count++;
  }
  return p;
}

void plant_destroy(plant *p) {
  if (p == NULL) return;
  pthread_mutex_lock(&p->mutex);
  p->closing = 1;
  pthread_cond_broadcast(&p->begin);
  pthread_mutex_unlock(&p->mutex);
  for (int i = 0; i < p->worker_count; i++) pthread_join(p->workers[i], NULL);
  for (int i = 0; i < p->vehicles; i++) {
    if (p->members[i].controller != NULL) mcu_destroy(p->members[i].controller);
  }
  pthread_cond_destroy(&p->begin);
  pthread_cond_destroy(&p->end);
  pthread_mutex_destroy(&p->mutex);
  free(p->members);
  free(p);
}

void plant_start(plant *p, uint64_t time_us) {
  const uint64_t whole = time_us - time_us % p->step_us;
  if (whole > p->time_us) p->time_us = whole;
  atomic_store(&p->next, 0);
  pthread_mutex_lock(&p->mutex);
  p->busy = p->worker_count;
  p->turn++;
  pthread_cond_broadcast(&p->begin);
  pthread_mutex_unlock(&p->mutex);
}

int plant_finish(plant *p) {
  run_members(p);
  pthread_mutex_lock(&p->mutex);
  while (p->busy > 0) pthread_cond_wait(&p->end, &p->mutex);
  pthread_mutex_unlock(&p->mutex);
  for (int i = 0; i < p->vehicles; i++) {
    if (p->members[i].failed) return i + 1;
  }
  return 0;
}

uint64_t plant_time_us(const plant *p) { return p->time_us; }

const char *plant_failure(const plant *p, int vehicle) { return p->members[vehicle].cause; }

plant_vehicle *plant_get_vehicle(plant *p, int vehicle) { return &p->members[vehicle].seen; }

mcu_faults *plant_get_faults(plant *p, int vehicle) { return mcu_get_faults(p->members[vehicle].controller); }

sensor_faults *plant_get_sensor_faults(plant *p, int vehicle) { return &p->members[vehicle].faults; }

const mcu_readings *plant_get_readings(plant *p, int vehicle) {
  return mcu_get_readings(p->members[vehicle].controller);
}

size_t plant_uart_write(plant *p, int vehicle, int port, const uint8_t *bytes, size_t count, uint64_t not_before_us) {
  return mcu_uart_write(p->members[vehicle].controller, port, bytes, count, not_before_us);
}

size_t plant_uart_read(plant *p, int vehicle, int port, uint8_t *bytes, size_t capacity) {
  return mcu_uart_read(p->members[vehicle].controller, port, bytes, capacity);
}

void plant_eeprom_read(plant *p, int vehicle, uint8_t bytes[MCU_EEPROM_BYTES]) {
  mcu_eeprom_read(p->members[vehicle].controller, bytes);
}

void plant_power_cycle(plant *p, int vehicle) { mcu_power_cycle(p->members[vehicle].controller); }
