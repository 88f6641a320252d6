// Ways from a measured position to velocity and acceleration, compared on the user's data (report section 1.3.4, and
// the Kalman filter of sections 4.1 and 4.3).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/common/signals/kalman_smoother.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::measurement {

// One way. What it cannot give is empty.
struct DerivativeMethod {
  std::string name;
  std::string_view explanation;
  // Standard deviation that the position's noise leaves; empty where it does not stay bounded.
  std::optional<double> velocity_noise, acceleration_noise;
  std::optional<double> lag_s;  // behind the reference: least squares of the velocity on it and on its slope
  // Root mean square of what differs from the reference, without the ends.
  std::optional<double> velocity_difference, acceleration_difference;
  std::vector<double> velocity, acceleration;  // acceleration is empty where it gives none
};

// Of one position of one experiment.
struct DerivativeComparison {
  std::string experiment;
  std::string_view column;     // the position's
  std::string_view reference;  // of which the methods differ: a measured velocity's column, or the smoother
  double sample_s = 0.0;
  double cutoff_hz = 0.0;
  std::vector<double> time_s;
  std::optional<double> step;  // of the encoder
  signals::MotionCovariances covariances;
  double corner_hz = 0.0;                             // of the smoother
  double velocity_rms = 0.0, acceleration_rms = 0.0;  // of the reference
  std::vector<DerivativeMethod> methods;
};

struct DerivativeOptions {
  bool motor = true, output = true;
  std::optional<double> cutoff_hz;  // else as the identification filters positions: 2.5 times the coherent band's
};

// All positions of all experiments, each in its longest segment. Throws data::DataError where there is none that is
// long enough, or a cut-off does not fit the sample rate.
std::vector<DerivativeComparison> compare_derivatives(const data::Dataset& dataset, const DerivativeOptions& options);

}  // namespace flexspline::measurement
