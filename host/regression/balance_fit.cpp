#include "host/regression/balance_fit.hpp"

#include <cmath>

#include "host/regression/between_records.hpp"
#include "host/regression/least_squares.hpp"
#include "host/regression/shapes.hpp"

namespace flexspline::regression {

Eigen::MatrixXd shape_columns(BalanceData& data, const Terms& terms, const std::vector<std::size_t>& on_balance,
                              const std::vector<Slot>& shapes) {
  return data.shape_columns(terms, on_balance, shapes);
}

NaturalValue natural_value(const Term& term, Slot asked, const std::vector<Slot>& slots,
                           const Eigen::MatrixXd& covariance) {
  NaturalValue result;
  result.value = catalogue::natural(*term.entry, term.values)[asked.parameter];
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(covariance.rows());
  for (std::size_t j = 0; j < slots.size(); ++j) {
    if (slots[j].term != asked.term) continue;
    std::vector<numbers::Jet> values(term.values.begin(), term.values.end());
    values[slots[j].parameter].v[0] = 1.0;
    slopes[static_cast<Eigen::Index>(j)] = catalogue::natural(*term.entry, values)[asked.parameter].v[0];
  }
  // What is not determined has an infinite variance, which must not meet a slope of nought.
  for (Eigen::Index i = 0; i < slopes.size(); ++i)
    for (Eigen::Index j = 0; j < slopes.size(); ++j)
      if (slopes[i] != 0.0 && slopes[j] != 0.0) result.variance += slopes[i] * covariance(i, j) * slopes[j];
  return result;
}

Eigen::VectorXd residual_of(BalanceData& data, const Terms& terms) {
  Eigen::VectorXd residual = data.target();
  for (const std::size_t t : terms_on(terms, data.balance(), data.prepared().torque_measured))
    residual -= data.term_torque(terms, t);
  for (const std::size_t t : terms_reaching(terms, data.balance(), data.prepared().torque_measured))
    residual -= data.term_torque(terms, t);
  return residual;
}

// Columns of the linear parameters. A column that is the target itself (the effort, where nothing but the effort fixes
// the scale of the torques, report 3.6) would explain everything by nothing: it is nought, so not determined.
static Eigen::MatrixXd columns_beside(BalanceData& data, const Terms& terms, const std::vector<Slot>& linear,
                                      const Eigen::VectorXd& target) {
  constexpr double kSame = 1e-3;
  Eigen::MatrixXd X = columns_of(data, terms, linear);
  for (std::size_t j = 0; j < linear.size(); ++j) {
    if ((terms[linear[j].term].entry->info->reads & effects::kTorqueScale) == 0) continue;
    const auto column = X.col(static_cast<Eigen::Index>(j));
    const double square = column.squaredNorm();
    if (square > 0.0 && (target - column * (column.dot(target) / square)).norm() < kSame * target.norm())
      X.col(static_cast<Eigen::Index>(j)).setZero();
  }
  return X;
}

BalanceFit fit_balance(BalanceData& data, Terms& terms) {
  BalanceFit fit;
  fit.balance = data.balance();
  fit.on_balance = terms_on(terms, data.balance(), data.prepared().torque_measured);
  fit.linear = free_linear_slots(terms, fit.on_balance);
  fit.shapes = free_shape_slots(terms, fit.on_balance);
  fit.root_weights = Eigen::VectorXd::Ones(data.rows());
  if (data.empty()) return fit;
  settle_grids(data, terms, fit.on_balance);
  const auto solve = [&] {
    const Eigen::VectorXd target = data.target() - data.known_torque(terms, fit.on_balance);
    const LinearFit linear = least_squares(columns_beside(data, terms, fit.linear, target), target, fit.root_weights);
    for (std::size_t j = 0; j < fit.linear.size(); ++j)
      terms[fit.linear[j].term].values[fit.linear[j].parameter] = linear.theta[static_cast<Eigen::Index>(j)];
    return linear;
  };
  // Weights and parameters depend on each other; two rounds settle them.
  sweep_shapes(data, terms, fit.on_balance, fit.root_weights);
  for (int round = 0; round < 2; ++round) {
    fit.root_weights = record_weights(data.records(), solve().residual);
    if (!fit.shapes.empty()) refine_shapes(data, terms, fit.on_balance, fit.root_weights);
  }
  fit.residual = solve().residual;

  // Uncertainty of linear parameters and shapes together, to first order.
  Eigen::MatrixXd J(data.rows(), static_cast<Eigen::Index>(fit.linear.size() + fit.shapes.size()));
  J << columns_beside(data, terms, fit.linear, data.target() - data.known_torque(terms, fit.on_balance)),
      shape_columns(data, terms, fit.on_balance, fit.shapes);
  const LinearFit joint = least_squares(J, fit.residual, fit.root_weights);
  const Eigen::VectorXd weighted = fit.root_weights.cwiseProduct(fit.residual);
  fit.autocorrelation_time =
      std::max(autocorrelation_time(data.records(), weighted), data.filter_autocorrelation_time());
  const double freedom = std::max(1.0, static_cast<double>(data.rows() - J.cols()));
  fit.covariance = joint.unit_covariance;
  std::vector<Eigen::Index> told;
  for (Eigen::Index j = 0; j < J.cols(); ++j)
    if (std::isfinite(joint.unit_covariance(j, j))) told.push_back(j);
  // Of the rows without what friction that differs from record to record does to them; that is added after.
  const std::vector<Group> groups = friction_groups(terms, fit.linear);
  Eigen::MatrixXd torques = Eigen::MatrixXd::Zero(data.rows(), static_cast<Eigen::Index>(groups.size()));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const Eigen::Index j : groups[g].columns) {
      const Slot& slot = fit.linear[static_cast<std::size_t>(j)];
      torques.col(static_cast<Eigen::Index>(g)) +=
          terms[slot.term].values[slot.parameter] * fit.root_weights.cwiseProduct(J.col(j));
    }
  const BetweenRecords between = between_records(data, torques, weighted);
  const Eigen::MatrixXd columns = fit.root_weights.asDiagonal() * J(Eigen::all, told);
  const Eigen::MatrixXd middle =
      robust_middle(data.records(), columns, between.left, robust_lags(between.autocorrelation_time, data.rows())) *
      (static_cast<double>(data.rows()) / freedom);
  const Eigen::MatrixXd unit = joint.unit_covariance(told, told);
  fit.covariance(told, told) = with_differences(between, data, torques, columns, unit, unit * middle * unit);
  fit.own_share = joint.own_share;
  fit.excitation = joint.share_beside_all;
  fit.white_variance = joint.unit_covariance.diagonal() * (weighted.squaredNorm() / freedom);
  fit.condition_number = joint.condition_number;
  return fit;
}

}  // namespace flexspline::regression
