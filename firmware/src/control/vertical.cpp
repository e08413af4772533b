// Hydrostatic depth and the filter's two gains.
#include "vertical.h"

namespace shoal {

void DepthEstimator::predict(float dt) { depth_ += descent_ * dt; }

void DepthEstimator::correct(float pressure_pa, const Parameters& parameters, float since) {
  const float measured =
      (pressure_pa - parameters.get(Parameter::SURF_PA)) / (parameters.get(Parameter::WATER_RHO) * kGravity);
  if (!started_) {
    depth_ = measured;
    started_ = true;
    return;
  }
  const float error = measured - depth_;
  depth_ += clamp(parameters.get(Parameter::DEP_KP) * since, 0.0f, 1.0f) * error;
  descent_ += clamp(parameters.get(Parameter::DEP_KI) * since, 0.0f, 4.0f) * error;
}

}  // namespace shoal
