// The balances of a fit in one Gauss-Newton step: the columns of the parameters and the residual at the estimates, from
// the measured samples or from others in their place. What measured signals do to estimates is computed with it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

struct Linearised {
  Eigen::MatrixXd J;         // a column a parameter
  Eigen::VectorXd residual;  // N m (N)
};

// By balance, the parameters whose error is known: their places in the fit's covariance. Empty where the balance's
// values rest on the evidence of another one as well.
std::vector<std::vector<Eigen::Index>> parameters_with_errors(const Identification& found);

Linearised linearised(const RegressionProblem& data, const BalanceFit& fit, const Terms& terms,
                      const std::vector<Eigen::Index>& parameters);

// All balances on the same samples, from these experiments in place of the measured ones.
std::vector<Linearised> linearised_with(const Identification& found,
                                        const std::vector<const data::Experiment*>& experiments,
                                        const Pipeline& pipeline,
                                        const std::vector<std::vector<Eigen::Index>>& parameters);

}  // namespace flexspline::estimation
