// One balance fitted: nonlinear parameters and linear parameters together, with weights by record and their
// uncertainty. Where friction differs from record to record and nothing else but noise is left, by generalised least
// squares.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/engine/estimation/noise_covariance.hpp"
#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

struct BalanceFit {
  Balance balance = Balance::motor;
  std::vector<std::size_t> on_balance;  // terms
  std::vector<ParameterRef> linear;     // free parameters that the torque is proportional to
  std::vector<ParameterRef> nonlinear;
  Eigen::VectorXd residual;      // target minus model, N m
  Eigen::VectorXd root_weights;  // one over the residual's RMS of each record
  // What the parameters were found with: weights, and friction that differs from record to record taken down.
  NoiseCovariance error_covariance = Eigen::VectorXd();
  Eigen::MatrixXd covariance;      // of linear, then nonlinear parameters; corrected for autocorrelation
  Eigen::VectorXd root_tolerance;  // likewise; see LinearFit
  Eigen::VectorXd excitation;      // likewise: LinearFit::root_tolerance_of_all
  Eigen::VectorXd white_variance;  // likewise: what the variances would be without autocorrelation
  double autocorrelation_time = 1.0;
  double condition_number = 0.0;
  double rmse() const {
    return residual.size() ? std::sqrt(residual.squaredNorm() / static_cast<double>(residual.size())) : 0.0;
  }
};

// Estimates all free parameters on the balance and writes them into `terms`. Nonlinear parameters that the model states
// are where the search starts; others are swept first. Parameters that the data do not determine are set to zero (see
// root_tolerance).
BalanceFit fit_balance(const RegressionProblem& data, Terms& terms);

// Variance of a parameter in its own unit, where it was searched for as a ratio or a root: it follows from the
// covariance of what the parameter depends on. `refs` are the parameters of `covariance`, in its order; the requested
// one need not be among them.
double natural_variance(const Term& term, ParameterRef requested, const std::vector<ParameterRef>& refs,
                        const Eigen::MatrixXd& covariance);

}  // namespace flexspline::estimation
