// Projection of torques on what a model can draw by moving its own parameters, and the part that is orthogonal to it.
#pragma once

#include <Eigen/Core>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

// Torque of all effects on the balance at their values, filtered as the target is, N m.
Eigen::VectorXd model_torque(const RegressionProblem& data, const Terms& terms);

// The columns that a fit of the model has on a balance: its free linear parameters, the slopes by its free nonlinear
// parameters, and a delay of the effort.
Eigen::MatrixXd model_columns(const RegressionProblem& data, const Terms& terms);

class ModelProjection {
 public:
  // Of what the columns span over samples of these weights; columns that others explain already add nothing.
  ModelProjection(const Eigen::MatrixXd& columns, const Eigen::VectorXd& root_weights);

  // What of each torque (a column) none of the model's parameters can take up, N m.
  Eigen::MatrixXd orthogonal_part(const Eigen::MatrixXd& torques) const;
  // Its share of the torque, 0 to 1, over samples of weight.
  double orthogonal_share(const Eigen::VectorXd& torque) const;

 private:
  Eigen::VectorXd root_weights_;
  Eigen::MatrixXd span_;  // orthonormal
};

}  // namespace flexspline::estimation
