// Two fins and a motor: the last place before the pins, where range and rate of every output are limited.
#pragma once

#include <stdint.h>

#include "../board.h"
#include "../params/parameters.h"

namespace shoal {

struct Outputs {
  float bow, stern;  // rad of fin
  float throttle;    // -1 to 1
};

class Actuators {
 public:
  explicit Actuators(Board& board) : board_(board) {}

  // Moves every output towards its target within the limits and sets the pulses.
  void step(const Outputs& target, const Parameters& parameters, float dt);
  // Sets every output to neutral at once.
  void neutral();

  const Outputs& outputs() const { return outputs_; }
  uint16_t pulse_us(Actuator actuator) const { return pulses_[static_cast<uint8_t>(actuator)]; }

 private:
  void write(Actuator actuator, float offset_us);

  Board& board_;
  Outputs outputs_ = {};
  uint16_t pulses_[3] = {};
};

}  // namespace shoal
