// The highest bandwidth for a regression on differentiated positions: the noise of the regressors is still small
// compared with the torque that they explain.
#pragma once

#include <string>
#include <vector>

#include "host/engine/selection/policy.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::selection {

struct Bandwidth {
  double highest_hz = 0.0;
  std::string reason;
};

// Standard deviation of white noise on a position, from its fourth differences (a difference-based estimator): those
// of white noise have the standard deviation sqrt(70) sigma, those of a smooth motion are negligible. Segments of fewer
// than five samples are left out; 0 where none is longer.
double noise_by_fourth_differences(const std::vector<double>& position, const std::vector<data::Segment>& segments);

// Never above an eighth of the lowest sample rate.
Bandwidth highest_bandwidth(const std::vector<const data::Experiment*>& experiments, const SelectionPolicy& policy);

}  // namespace flexspline::selection
