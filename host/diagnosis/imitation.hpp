// What of a torque a model can imitate by moving its own parameters, and what it cannot.
#pragma once

#include <Eigen/Core>

#include "host/regression/balance_data.hpp"

namespace flexspline::diagnosis {

// Torque of all effects on the balance at their values, filtered as the rows are, N m.
Eigen::VectorXd model_torque(regression::BalanceData& data, const regression::Terms& terms);

// The columns that a fit of the model has on a balance: its free linear parameters, the slopes by its free shapes, and
// a delay of the effort.
Eigen::MatrixXd model_columns(regression::BalanceData& data, const regression::Terms& terms);

class Imitation {
 public:
  // Of what the columns span over rows of these weights; columns that others explain already add nothing.
  Imitation(const Eigen::MatrixXd& columns, const Eigen::VectorXd& root_weights);

  // What of each torque (a column) none of the model's parameters can take up, N m.
  Eigen::MatrixXd own_part(const Eigen::MatrixXd& torques) const;
  // Its share of the torque, 0 to 1, over rows of weight.
  double own_share(const Eigen::VectorXd& torque) const;

 private:
  Eigen::VectorXd root_weights_;
  Eigen::MatrixXd span_;  // orthonormal
};

}  // namespace flexspline::diagnosis
