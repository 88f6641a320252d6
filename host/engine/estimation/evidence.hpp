// Parameters that show on two torque balances: an error of the gear twists the spring and turns the motor.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/noise_covariance.hpp"
#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

// What a balance says of parameters that are identified on another one, at their present values: the
// score vector (gradient of its log likelihood) and the observed information, the balance's own parameters free.
struct ScoreAndInformation {
  Eigen::VectorXd score;
  Eigen::MatrixXd information;
};

// Slopes of the torque of term `t` on `data` by its parameters, a column each, about the values in `terms`. By
// differences: what reaches over to another balance does so in proportion.
Eigen::MatrixXd cross_balance_columns(const RegressionProblem& data, const Terms& terms, std::size_t t,
                                      const std::vector<std::size_t>& parameters);

// `cross_columns`: slopes of the requested parameters; `own`: of the balance's own parameters; `residual` at the
// present values. Of the whitened errors `autocorrelation_time` samples count as one.
ScoreAndInformation score_and_information(const Eigen::MatrixXd& cross_columns, const Eigen::MatrixXd& own,
                                          const Eigen::VectorXd& residual, const NoiseCovariance& error_covariance,
                                          double autocorrelation_time);

// The noise of a balance where those of `cross_columns` are not at their final values: those and the balance's own are
// fitted to first order for the moment, so that their errors are not taken for friction that differs.
struct NoiseModel {
  NoiseCovariance error_covariance;
  double autocorrelation_time;
};
NoiseModel noise_model(const Eigen::MatrixXd& cross_columns, const Eigen::MatrixXd& own, const RegressionProblem& data,
                       const Terms& terms, const BalanceFit& fit, const Eigen::VectorXd& residual);

// Inverse of a covariance or a precision whose parameters differ much in size by their units.
Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& symmetric);

// The most likely change of parameters of which their own balance has this precision (inverse covariance), with what
// that costs there (twice the log likelihood) and their covariance then.
struct CombinedEstimate {
  Eigen::VectorXd change;
  double cost = 0.0;
  Eigen::MatrixXd covariance;
};
CombinedEstimate combine(const Eigen::MatrixXd& precision, const ScoreAndInformation& other);

}  // namespace flexspline::estimation
