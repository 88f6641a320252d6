#include "host/estimation/balance_fit.hpp"

#include <cmath>

#include "host/estimation/least_squares.hpp"
#include "host/estimation/record_variance.hpp"
#include "host/estimation/variable_projection.hpp"

namespace flexspline::estimation {

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
  // What is not determined has an infinite variance, which must not meet a slope of zero.
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
// the scale of the torques, report 3.6) would explain everything by nothing: it is zero, so not determined.
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

// A fit as it proceeds, at the values that the terms have.
class Fitting {
 public:
  Fitting(BalanceData& data, Terms& terms, BalanceFit& fit) : data_(data), terms_(terms), fit_(fit) {}

  // Weights by record and parameters, one after the other.
  void fit_weighted();
  // With friction that differs between records, if that leaves nothing but noise: generalised least squares.
  void fit_generalised();
  // Of linear parameters and shapes together, to first order.
  void take_uncertainty();

 private:
  // Linear parameters at given shapes; `whitening` says what each row's error counts.
  void solve(const NoiseCovariance& whitening) {
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
    return columns * random_effect_directions(friction_groups(terms_, fit_.linear, fit_.shapes), theta,
                                              Eigen::VectorXd::Ones(columns.cols()),
                                              static_cast<Eigen::Index>(fit_.linear.size()));
  }

  // How friction differs between records at the present values.
  void estimate_differences() {
    J_ = columns();
    friction_ = friction(J_);
    torques_ = noise_weights_.asDiagonal() * friction_;
    between_ = paule_mandel(data_, torques_, noise_weights_.cwiseProduct(fit_.residual));
  }

  BalanceData& data_;
  Terms& terms_;
  BalanceFit& fit_;
  Eigen::VectorXd noise_weights_;  // of the rows without what the records' own friction does to them
  Eigen::MatrixXd J_, friction_, torques_;
  RecordVariance between_;
};

void Fitting::fit_weighted() {
  // Weights and parameters depend on each other; two rounds are enough.
  sweep_shapes(data_, terms_, fit_.on_balance, fit_.root_weights);
  for (int round = 0; round < 2; ++round) {
    solve(fit_.root_weights);
    fit_.root_weights = record_weights(data_.records(), fit_.residual);
    if (!fit_.shapes.empty()) refine_shapes(data_, terms_, fit_.on_balance, fit_.root_weights);
  }
  solve(fit_.root_weights);
  fit_.whitening = noise_weights_ = fit_.root_weights;
}

void Fitting::fit_generalised() {
  estimate_differences();
  const Terms weighted_terms = terms_;
  const Eigen::VectorXd weighted_residual = fit_.residual;
  constexpr int kGeneralised = 3;
  for (int round = 0; round < kGeneralised && between_.std.size() > 0 && between_.std.maxCoeff() > 0.0; ++round) {
    noise_weights_ = record_weights(data_.records(), between_.left.cwiseQuotient(noise_weights_));
    fit_.whitening = noise_covariance(data_, noise_weights_, noise_weights_.asDiagonal() * friction_, between_.std,
                                      between_.autocorrelation_time);
    // With friction that differs a small effect has another best shape than without, and far away.
    if (round == 0) sweep_shapes(data_, terms_, fit_.on_balance, fit_.whitening, SweepFrom::values);
    if (!fit_.shapes.empty()) refine_shapes(data_, terms_, fit_.on_balance, fit_.whitening);
    solve(fit_.whitening);
    estimate_differences();
  }
  if (fit_.whitening.is_diagonal()) return;
  if (leaves_noise(between_, data_)) {
    fit_.root_weights = record_weights(data_.records(), fit_.residual);
    return;
  }
  terms_ = weighted_terms;
  fit_.residual = weighted_residual;
  fit_.whitening = noise_weights_ = fit_.root_weights;
  estimate_differences();
}

void Fitting::take_uncertainty() {
  const Eigen::VectorXd weighted = fit_.root_weights.cwiseProduct(fit_.residual);
  fit_.autocorrelation_time =
      std::max(autocorrelation_time(data_.records(), weighted), data_.filter_autocorrelation_time());
  const LinearFit joint = least_squares(J_, fit_.residual, fit_.root_weights);
  const LinearFit generalised = fit_.whitening.is_diagonal() ? joint : least_squares(J_, fit_.residual, fit_.whitening);
  const double freedom = std::max(1.0, static_cast<double>(data_.rows() - J_.cols()));
  fit_.covariance = generalised.unit_covariance;
  std::vector<Eigen::Index> identified;
  for (Eigen::Index j = 0; j < J_.cols(); ++j)
    if (std::isfinite(generalised.unit_covariance(j, j))) identified.push_back(j);
  // Of the rows without what friction that differs from record to record does to them; that is added after.
  const Eigen::MatrixXd columns = fit_.whitening.score_columns(J_(Eigen::all, identified));
  const Eigen::MatrixXd middle = newey_west(data_.records(), columns, between_.left,
                                            newey_west_lags(between_.autocorrelation_time, data_.rows())) *
                                 (static_cast<double>(data_.rows()) / freedom);
  const Eigen::MatrixXd unit = generalised.unit_covariance(identified, identified);
  fit_.covariance(identified, identified) =
      add_record_variance(between_, data_, torques_, columns, unit, unit * middle * unit);
  fit_.root_tolerance = joint.root_tolerance;
  fit_.excitation = joint.root_tolerance_of_all;
  fit_.white_variance =
      generalised.unit_covariance.diagonal() * ((fit_.whitening * fit_.residual).squaredNorm() / freedom);
  fit_.condition_number = joint.condition_number;
}

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
  set_grid_values(data, terms, fit.on_balance);
  Fitting fitting(data, terms, fit);
  fitting.fit_weighted();
  fitting.fit_generalised();
  fitting.take_uncertainty();
  return fit;
}

}  // namespace flexspline::estimation
