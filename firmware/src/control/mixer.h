// The mixer: which servo carries how much of the rudder and of the plane command, by parameter.
#pragma once

#include "../drivers/actuators.h"
#include "autopilot.h"

namespace shoal {

inline Outputs mix(const Commands& commands, const Parameters& parameters) {
  return {
      commands.rudder * parameters.get(Parameter::BOW_YAW) + commands.plane * parameters.get(Parameter::BOW_PITCH),
      commands.rudder * parameters.get(Parameter::STERN_YAW) + commands.plane * parameters.get(Parameter::STERN_PITCH),
      commands.throttle,
  };
}

}  // namespace shoal
