// Physical variables that a residual may depend on, with one value for each sample, and bins over them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::comparison {

struct SampleVariable {
  std::string name;        // velocity, speed, acceleration, motor_angle, output_angle, current, torque, ...
  std::string unit;        // "" for none
  Eigen::VectorXd values;  // one a sample; NaN where the sample's record does not have it
  // Narrower bins have no physical meaning, however many samples they have.
  double narrowest_bin = 0.0;
};

// All variables that the data hold and that vary: velocity, speed (of the motor; of the output on the load balance),
// acceleration, motor_angle (within a turn, rad), output_angle, current, torque, torsion, torsion_rate, temperature,
// time and travel (since the last reversal). Torsion and its rate are output side. SI units of the axis.
std::vector<SampleVariable> sample_variables(const estimation::RegressionProblem& data, data::Axis axis);

// Direction of the balance's friction in each sample: +1, -1, or NaN at rest.
Eigen::VectorXd sample_directions(const estimation::RegressionProblem& data);

// Bins of about equal counts.
struct Bins {
  std::vector<int> bin;       // one a sample; -1 where the variable has no value
  std::vector<double> edges;  // count() + 1; values are in [edges[b], edges[b + 1]], the last included
  std::size_t count() const { return edges.empty() ? 0 : edges.size() - 1; }
};

// At most `wanted` bins; fewer where values are repeated or bins would be narrower than `narrowest`. None where all
// values are equal, or where their range is too narrow for two bins.
Bins equal_count_bins(const Eigen::VectorXd& values, std::size_t wanted, double narrowest = 0.0);

}  // namespace flexspline::comparison
