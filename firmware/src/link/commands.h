// What the other side may ask for: setpoints, commands, parameters, time; everything checked, everything answered.
#pragma once

#include <stdint.h>

#include "../parts.h"
#include "frame.h"
#include "notices.h"
#include "telemetry.h"

namespace shoal {

class Commands {
 public:
  Commands(Parts& parts, FrameWriter& writer, Telemetry& telemetry, Notices& notices)
      : parts_(parts), writer_(writer), telemetry_(telemetry), notices_(notices) {}

  void handle(const Frame& frame);
  // Sends the next of a requested list of parameters; true when there was one.
  bool step();

 private:
  enum class Dialect : uint8_t { unknown, equal, different };

  void on_setpoint(const Frame& frame);
  void on_version(const Frame& frame);
  void on_command(const Frame& frame);
  void on_parameter_set(const Frame& frame);
  void on_parameter_read(const Frame& frame);
  void on_timesync(const Frame& frame);
  uint8_t execute(uint16_t command, float p1, float p2, const Frame& frame);
  uint8_t arm(const Frame& frame);
  uint8_t store(float action);
  bool addressed(uint8_t system, uint8_t component) const;
  bool send_parameter(uint8_t index);

  Parts& parts_;
  FrameWriter& writer_;
  Telemetry& telemetry_;
  Notices& notices_;
  uint8_t list_next_ = kParameterCount;  // next parameter of a requested list
  Dialect dialect_ = Dialect::unknown;
  uint8_t their_hash_[8] = {};
};

}  // namespace shoal
