// Depth and vertical speed from pressure: a second-order complementary filter that coasts between samples.
#pragma once

#include "../params/parameters.h"
#include "maths.h"

namespace shoal {

class DepthEstimator {
 public:
  void reset() { *this = DepthEstimator(); }

  // Advances by `dt`, without a new sample.
  void predict(float dt);
  // Takes a sample of absolute pressure (Pa) that came `since` seconds after the one before.
  void correct(float pressure_pa, const Parameters& parameters, float since);

  float depth() const { return depth_; }      // m, down positive
  float descent() const { return descent_; }  // m/s, down positive

 private:
  float depth_ = 0.0f;
  float descent_ = 0.0f;
  bool started_ = false;
};

}  // namespace shoal
