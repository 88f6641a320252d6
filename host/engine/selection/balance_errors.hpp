// Errors and noise of a balance, as the user is told of them.
#pragma once

#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// The variables over which a residual has structure, and their shares of it in percent, from `least` on.
std::vector<LocalisedResidual> shares(const RegressionProblem& data, const CrossValidatedFit& fit,
                                      const Eigen::VectorXd& residual, double least = kPolicy.shown_share_percent);

// The errors of the model without what is named, and the noise.
void describe_base(const SearchedBalance& chosen, Diagnosis& result);

// The errors of the motor's balance, in place of those of the one that was chosen.
void describe_motor_instead(const SearchedBalance& chosen, const SearchedBalance& motor, Diagnosis& result);

}  // namespace flexspline::selection
