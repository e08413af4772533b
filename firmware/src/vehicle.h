// The vehicle: one tick a hundred times a second, always in the same order.
#pragma once

#include "link/link.h"
#include "parts.h"

namespace shoal {

// Owns all state, so that many vehicles run in one process. `tick` never waits.
class Vehicle {
 public:
  explicit Vehicle(Board& board) : parts_(board), link_(parts_) {}

  // Loads the parameters and sets the outputs to neutral; call once, before the first tick.
  void begin();
  // Call every 10 ms.
  void tick();

  const Parts& parts() const { return parts_; }
  const LossCounters& losses() const { return link_.losses(); }

 private:
  bool even() const { return (parts_.loop.ticks & 1) == 0; }
  void start_tick();
  void sense();
  void estimate();
  void guard();
  void control();
  void act();
  void report();
  void end_tick();

  Parts parts_;
  Link link_;
  Effort effort_ = {0.0f, 0.0f, 0.0f};
  uint32_t tick_started_us_ = 0;
  uint32_t spare_us_ = 0;
  uint32_t mean_us_times_32_ = 0;
  uint16_t elapsed_ms_ = 0;
  uint16_t pressure_age_ms_ = 0;
  bool new_imu_ = false;
  bool new_pressure_ = false;
  bool was_driving_ = false;
};

}  // namespace shoal
