// The mixer: which servo carries how much of the rudder and of the plane command, by parameter.
#pragma once

#include "../drivers/actuators.h"
#include "autopilot.h"

namespace shoal {

inline Outputs mix(const Effort& effort, const Parameters& parameters) {
  return {
      effort.rudder * parameters.get(Parameter::BOW_YAW) + effort.plane * parameters.get(Parameter::BOW_PITCH),
      effort.rudder * parameters.get(Parameter::STERN_YAW) + effort.plane * parameters.get(Parameter::STERN_PITCH),
      effort.throttle,
  };
}

}  // namespace shoal
