// Friction that differs from record to record (temperature, grease, run-in): by how much, and what that does to
// estimates that were made as if it did not.
#pragma once

#include <Eigen/Core>

#include "host/engine/estimation/friction_groups.hpp"
#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

// Each record has a factor 1 + b on the torque of each group, b of mean zero.
struct RecordVariance {
  Eigen::VectorXd std;                // of b, by group; zero where records do not differ for certain
  Eigen::VectorXd freedom;            // of that estimate: records that identify it, less one
  Eigen::VectorXd left;               // residual without the records' own factors
  double autocorrelation_time = 1.0;  // of what is left
  // Whether differences of friction leave nothing but noise. A missing effect differs from record to record, too, and
  // to take that for friction ruins what the model knows of friction.
  bool leaves_noise = true;
};

// From a fit's residual and the friction torques (a column a group), both weighted. The variance of b is the one at
// which the factors of the records scatter as they should, after their own errors (Paule and Mandel, 1982).
RecordVariance paule_mandel(const RegressionProblem& data, const Eigen::MatrixXd& torques,
                            const Eigen::VectorXd& residual);

// Covariance of the estimates (`unit` is (X'WX)^-1, `columns` W^1/2 X), `within` being what it is without differences
// between records: what those add, and all of it widened so far that 1.96 standard errors hold 95 % although the
// spread is known from few records (Student's t, degrees of freedom after Satterthwaite).
Eigen::MatrixXd add_record_variance(const RecordVariance& between, const RegressionProblem& data,
                                    const Eigen::MatrixXd& torques, const Eigen::MatrixXd& columns,
                                    const Eigen::MatrixXd& unit, const Eigen::MatrixXd& within);

}  // namespace flexspline::estimation
