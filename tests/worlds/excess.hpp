// How much of the base model's error each thing makes, on signals without noise.
#pragma once

#include <vector>

#include "tests/worlds/draw.hpp"

namespace flexspline::worlds {

// What stands in the model that is fitted.
struct Fitted {
  bool presliding = false;                  // the direction with presliding in the place of the sign of the velocity
  std::vector<const HiddenEffect*> hidden;  // with their true nonlinear parameters
};

// RMS error of the base model and of what is added, fitted by least squares to all moving samples. N m at the motor.
// `last`: where the coefficient of the last column goes.
double error_after_fit(const Twin& twin, const std::vector<Motion>& motions, const Fitted& fitted,
                       double* last = nullptr);

// The records without noise, pulses and coloured friction, in coarse steps.
std::vector<Motion> without_noise(const Twin& twin);

// Shares of the squared error of the base model. That of presliding and of what is hidden: by how much the squared
// error rises where it alone is missing from the true model. The others': by how much it falls in a world without it.
struct Shares {
  double error = 0.0;  // RMS of the base model without noise, N m
  double presliding = 0.0, second = 0.0, directions = 0.0, elastic = 0.0;
};

// Sets the sizes of what is hidden and of the second structure so that their shares come out as wanted, as far as that
// is plausible, adds to the accepted names those that are confounded on these motions, and returns the shares of all.
Shares fit_sizes(Twin& twin);

}  // namespace flexspline::worlds
