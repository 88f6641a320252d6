// One balance on which missing effects are searched for.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "host/engine/selection/cross_validation.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

// One balance with the model as it is.
struct BalanceSearch {
  const RegressionProblem* data = nullptr;
  Eigen::VectorXd keep;  // zero for samples in which a disturbance acted
  CrossValidatedFit base;
  std::optional<double> floor = std::nullopt;  // RMS of the noise, N m, where it is known

  bool at_floor(const CrossValidatedFit& fit) const { return floor && fit.rmse() < kPolicy.at_floor * *floor; }
};

}  // namespace flexspline::selection
