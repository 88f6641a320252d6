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

namespace {

// A fit as it proceeds: columns and residual at the values that the terms have.
class Fitting {
 public:
  Fitting(BalanceData& data, Terms& terms, BalanceFit& fit) : data_(data), terms_(terms), fit_(fit) {}

  // Linear parameters at given shapes; `whitening` says what each row's error counts.
  void solve(const Whitening& whitening) {
    const Eigen::VectorXd target = data_.target() - data_.known_torque(terms_, fit_.on_balance);
    const Eigen::MatrixXd X = columns_beside(data_, terms_, fit_.linear, target);
    const LinearFit linear = least_squares(X, target, whitening);
    for (std::size_t j = 0; j < fit_.linear.size(); ++j)
      terms_[fit_.linear[j].term].values[fit_.linear[j].parameter] = linear.theta[static_cast<Eigen::Index>(j)];
    fit_.residual = linear.residual;
  }

  // Columns of linear parameters and shapes.
  Eigen::MatrixXd columns() {
    Eigen::MatrixXd J(data_.rows(), static_cast<Eigen::Index>(fit_.linear.size() + fit_.shapes.size()));
    J << columns_beside(data_, terms_, fit_.linear, data_.target() - data_.known_torque(terms_, fit_.on_balance)),
        shape_columns(data_, terms_, fit_.on_balance, fit_.shapes);
    return J;
  }

  // What a factor of each group of friction does to the torque, of `columns`.
  Eigen::MatrixXd friction(const Eigen::MatrixXd& columns) const {
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(columns.cols());
    for (std::size_t j = 0; j < fit_.linear.size(); ++j)
      theta[static_cast<Eigen::Index>(j)] = terms_[fit_.linear[j].term].values[fit_.linear[j].parameter];
    return columns * directions(friction_groups(terms_, fit_.linear, fit_.shapes), theta,
                                Eigen::VectorXd::Ones(columns.cols()), static_cast<Eigen::Index>(fit_.linear.size()));
  }

 private:
  BalanceData& data_;
  Terms& terms_;
  BalanceFit& fit_;
};

}  // namespace

BalanceFit fit_balance(BalanceData& data, Terms& terms) {
  BalanceFit fit;
  fit.balance = data.balance();
  fit.on_balance = terms_on(terms, data.balance(), data.prepared().torque_measured);
  fit.linear = free_linear_slots(terms, fit.on_balance);
  fit.shapes = free_shape_slots(terms, fit.on_balance);
  fit.root_weights = Eigen::VectorXd::Ones(data.rows());
  fit.whitening = fit.root_weights;
  if (data.empty()) return fit;
  settle_grids(data, terms, fit.on_balance);
  Fitting fitting(data, terms, fit);
  // Weights and parameters depend on each other; two rounds settle them.
  sweep_shapes(data, terms, fit.on_balance, fit.root_weights);
  for (int round = 0; round < 2; ++round) {
    fitting.solve(fit.root_weights);
    fit.root_weights = record_weights(data.records(), fit.residual);
    if (!fit.shapes.empty()) refine_shapes(data, terms, fit.on_balance, fit.root_weights);
  }
  fitting.solve(fit.root_weights);
  fit.whitening = fit.root_weights;

  // Of the rows without what the records' own friction does to them.
  Eigen::VectorXd noise_weights = fit.root_weights;
  Eigen::MatrixXd J, friction, torques;
  BetweenRecords between;
  const auto look_between = [&] {
    J = fitting.columns();
    friction = fitting.friction(J);
    torques = noise_weights.asDiagonal() * friction;
    between = between_records(data, torques, noise_weights.cwiseProduct(fit.residual));
  };
  look_between();
  const Terms weighted_terms = terms;
  const Eigen::VectorXd weighted_residual = fit.residual;
  constexpr int kGeneralised = 3;
  for (int round = 0; round < kGeneralised && between.std.size() > 0 && between.std.maxCoeff() > 0.0; ++round) {
    noise_weights = record_weights(data.records(), between.left.cwiseQuotient(noise_weights));
    fit.whitening = whitening_of(data, noise_weights, noise_weights.asDiagonal() * friction, between.std,
                                 between.autocorrelation_time);
    // Beside friction that differs a small effect has another best shape than without, and far away.
    if (round == 0) sweep_shapes(data, terms, fit.on_balance, fit.whitening, SweepFrom::values);
    if (!fit.shapes.empty()) refine_shapes(data, terms, fit.on_balance, fit.whitening);
    fitting.solve(fit.whitening);
    look_between();
  }
  if (!fit.whitening.weights_only() && leaves_noise(between, data)) {
    fit.root_weights = record_weights(data.records(), fit.residual);
  } else if (!fit.whitening.weights_only()) {
    terms = weighted_terms;
    fit.residual = weighted_residual;
    fit.whitening = noise_weights = fit.root_weights;
    look_between();
  }

  // Uncertainty of linear parameters and shapes together, to first order.
  const Eigen::VectorXd weighted = fit.root_weights.cwiseProduct(fit.residual);
  fit.autocorrelation_time =
      std::max(autocorrelation_time(data.records(), weighted), data.filter_autocorrelation_time());
  const LinearFit joint = least_squares(J, fit.residual, fit.root_weights);
  const LinearFit white = fit.whitening.weights_only() ? joint : least_squares(J, fit.residual, fit.whitening);
  const double freedom = std::max(1.0, static_cast<double>(data.rows() - J.cols()));
  fit.covariance = white.unit_covariance;
  std::vector<Eigen::Index> told;
  for (Eigen::Index j = 0; j < J.cols(); ++j)
    if (std::isfinite(white.unit_covariance(j, j))) told.push_back(j);
  // Of the rows without what friction that differs from record to record does to them; that is added after.
  const Eigen::MatrixXd columns = fit.whitening.twice(J(Eigen::all, told));
  const Eigen::MatrixXd middle =
      robust_middle(data.records(), columns, between.left, robust_lags(between.autocorrelation_time, data.rows())) *
      (static_cast<double>(data.rows()) / freedom);
  const Eigen::MatrixXd unit = white.unit_covariance(told, told);
  fit.covariance(told, told) = with_differences(between, data, torques, columns, unit, unit * middle * unit);
  fit.own_share = joint.own_share;
  fit.excitation = joint.share_beside_all;
  fit.white_variance = white.unit_covariance.diagonal() * ((fit.whitening * fit.residual).squaredNorm() / freedom);
  fit.condition_number = joint.condition_number;
  return fit;
}

}  // namespace flexspline::regression
