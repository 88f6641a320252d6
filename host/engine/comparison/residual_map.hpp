// What a residual depends on: which variables, directions and orders of the motor's turn explain its variance.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::comparison {

struct Share {
  // A variable of sample_variables, "direction", or "record", for maps of the residual; with " x direction" behind it
  // for maps of the residual times the direction of motion (what resists motion shows there); "motor_angle order 7" for
  // one order of the motor's turn.
  std::string variable;
  double share_percent = 0.0;  // of the residual's variance, less what bins or waves explain of pure noise
};

// Largest share first; only those that an F test at 1e-3 (of each kind of map) separates from noise, where samples are
// counted as independent after the autocorrelation time of what the map leaves, at most `autocorrelation_time`. Shares
// overlap, so they need not add up to less than 100 %.
std::vector<Share> localise(const estimation::RegressionProblem& data, const Eigen::VectorXd& residual,
                            double autocorrelation_time, data::Axis axis = data::Axis::rotary);

}  // namespace flexspline::comparison
