// Battery voltage, current and charge used, and the leak sensor.
#pragma once

#include "../board.h"
#include "../params/parameters.h"

namespace shoal {

class Power {
 public:
  explicit Power(Board& board) : board_(board) {}

  // Reads both inputs and the leak sensor; a first-order low pass of 0.5 s smooths voltage and current.
  void step(float dt);

  float voltage_v() const { return voltage_v_; }
  float current_a() const { return current_a_; }
  float used_ah() const { return used_ah_; }
  // Of BAT_CAP_AH, counted from a full battery at start, 0 to 100.
  int8_t remaining_percent(const Parameters& parameters) const;
  bool leak() const { return leak_; }

 private:
  Board& board_;
  float voltage_v_ = 0.0f;
  float current_a_ = 0.0f;
  float used_ah_ = 0.0f;
  bool leak_ = false;
  bool first_ = true;
};

}  // namespace shoal
