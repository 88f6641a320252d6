// Weighted linear least squares by orthogonal factorisation, and what the data determine.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/noise_covariance.hpp"
#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

struct LinearFit {
  Eigen::VectorXd theta;            // one a column of X
  Eigen::VectorXd residual;         // y - X theta, unweighted
  Eigen::MatrixXd unit_covariance;  // (X' W X)^-1; infinite on what is not determined
  // Of each column, the share that is orthogonal to all other columns (sine of its angle to their span), 0 to 1: the
  // square root of the tolerance 1 - R^2, one over the variance inflation factor. Below
  // kUndetermined the parameter is left at zero and the data do not identify it.
  Eigen::VectorXd root_tolerance;
  Eigen::VectorXd root_tolerance_of_all;  // the same, counting also the columns that were taken out as not determined
  double condition_number = 0.0;          // of the columns scaled to unit length
};
inline constexpr double kUndetermined = 1e-3;

// Minimises |W^(1/2) (y - X theta)| by a Householder factorisation with column pivoting of the scaled columns.
// `root_weights`: square roots of the weights, one a sample. A column of zeros is undetermined.
LinearFit least_squares(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Eigen::VectorXd& root_weights);

// Generalised least squares (Aitken 1935): the same with errors that samples of a record have in common.
LinearFit generalised_least_squares(const Eigen::MatrixXd& X, const Eigen::VectorXd& y,
                                    const NoiseCovariance& error_covariance);

// Square roots of weights: one over the residual's RMS of each record, repeated along its samples: records with more
// noise count less. No root weight is above ten times the median one, so that a silent record does not rule the fit.
Eigen::VectorXd root_record_weights(const std::vector<RowRange>& records, const Eigen::VectorXd& residual);

// What neighbouring samples have in common, in a covariance (Newey and West 1987): the sum over lags of the products of
// columns and residual, X'rr'X with weights that fall to zero at `lags` samples. The covariance of least squares with
// unit covariance U is then U times this times U; that of an estimate by instruments has the instruments as columns.
// Columns and residual are weighted; a lag does not reach from one record into another.
Eigen::MatrixXd newey_west(const std::vector<RowRange>& records, const Eigen::MatrixXd& columns,
                           const Eigen::VectorXd& residual, Eigen::Index lags);

// The lags that are used for a residual of this autocorrelation time.
Eigen::Index newey_west_lags(double autocorrelation_time, Eigen::Index rows);

// Samples that count as one: integrated autocorrelation time of the weighted residual over all records, at least one.
double autocorrelation_time(const std::vector<RowRange>& records, const Eigen::VectorXd& weighted_residual);
// The same of a whole balance, at least that of its filter.
double autocorrelation_time(const RegressionProblem& data, const Eigen::VectorXd& weighted_residual);

}  // namespace flexspline::estimation
