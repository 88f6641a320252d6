#include "host/engine/estimation/model_projection.hpp"

#include <Eigen/QR>
#include <algorithm>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/balance_fit.hpp"

namespace flexspline::estimation {

Eigen::VectorXd model_torque(const RegressionProblem& data, const Terms& terms) {
  const auto on_balance = terms_on(terms, data.balance(), data.prepared().output_signals);
  Eigen::VectorXd sum = data.known_torque(terms, on_balance);
  for (const std::size_t t : on_balance) {
    if (!terms[t].adds_torque() || terms[t].scaled_by_none()) continue;
    for (std::size_t p = 0; p < terms[t].values.size(); ++p)
      if (terms[t].free_linear(p) && terms[t].values[p] != 0.0) sum += terms[t].values[p] * data.column(terms, {t, p});
  }
  return sum;
}

Eigen::MatrixXd model_columns(const RegressionProblem& data, const Terms& terms) {
  const auto on_balance = terms_on(terms, data.balance(), data.prepared().output_signals);
  const std::vector<ParameterRef> linear = free_linear_parameters(terms, on_balance);
  const std::vector<ParameterRef> nonlinear = free_nonlinear_parameters(terms, on_balance);
  Eigen::MatrixXd X(data.rows(), static_cast<Eigen::Index>(linear.size() + nonlinear.size() + 1));
  X << data.slopes(terms, on_balance, linear, nonlinear), data.delay_column();
  return X;
}

ModelProjection::ModelProjection(const Eigen::MatrixXd& columns, const Eigen::VectorXd& root_weights)
    : root_weights_(root_weights) {
  Eigen::MatrixXd scaled = root_weights.asDiagonal() * columns;
  for (auto column : scaled.colwise()) column /= std::max(column.norm(), 1e-300);
  span_ = algebra::PivotedQr(scaled, 1e-7).span();
}

Eigen::MatrixXd ModelProjection::orthogonal_part(const Eigen::MatrixXd& torques) const {
  Eigen::MatrixXd left = root_weights_.asDiagonal() * torques;
  left -= span_ * (span_.transpose() * left);
  // Samples without weight are not used.
  return (root_weights_.array() > 0.0).select(root_weights_.array(), 1.0).inverse().matrix().asDiagonal() * left;
}

double ModelProjection::orthogonal_share(const Eigen::VectorXd& torque) const {
  const double whole = root_weights_.cwiseProduct(torque).norm();
  return whole > 0.0 ? root_weights_.cwiseProduct(orthogonal_part(torque).col(0)).norm() / whole : 0.0;
}

}  // namespace flexspline::estimation
