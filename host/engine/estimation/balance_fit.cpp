#include "host/engine/estimation/balance_fit.hpp"

#include <cmath>

#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/record_variance.hpp"
#include "host/engine/estimation/variable_projection.hpp"

namespace flexspline::estimation {

double natural_variance(const Term& term, ParameterRef requested, const std::vector<ParameterRef>& refs,
                        const Eigen::MatrixXd& covariance) {
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(covariance.rows());
  for (std::size_t j = 0; j < refs.size(); ++j) {
    if (refs[j].term != requested.term) continue;
    std::vector<numbers::Jet> values(term.values.begin(), term.values.end());
    values[refs[j].parameter].v[0] = 1.0;
    slopes[static_cast<Eigen::Index>(j)] = catalogue::natural(*term.entry, values)[requested.parameter].v[0];
  }
  double variance = 0.0;
  // An undetermined parameter has an infinite variance, which must not be multiplied by a slope of zero.
  for (Eigen::Index i = 0; i < slopes.size(); ++i)
    for (Eigen::Index j = 0; j < slopes.size(); ++j)
      if (slopes[i] != 0.0 && slopes[j] != 0.0) variance += slopes[i] * covariance(i, j) * slopes[j];
  return variance;
}

namespace {

// A fit as it proceeds, at the values that the terms have.
class Fitting {
 public:
  Fitting(const RegressionProblem& data, Terms& terms, BalanceFit& fit) : data_(data), terms_(terms), fit_(fit) {}

  // Weights by record and parameters, one after the other.
  void fit_weighted();
  // With friction that differs between records, if that leaves nothing but noise: generalised least squares.
  void fit_generalised();
  // Of linear parameters and nonlinear parameters together, to first order.
  void take_uncertainty();

 private:
  // The regression at the present nonlinear parameters. A column that equals the target (the effort, where only the
  // effort fixes the scale of the torques, report 3.6) would be a trivial solution: it is set to zero, so it is not
  // determined.
  void form_regression() {
    constexpr double kSame = 1e-3;
    regression_ = data_.regression(terms_, fit_.on_balance, fit_.linear);
    for (std::size_t j = 0; j < fit_.linear.size(); ++j) {
      if ((terms_[fit_.linear[j].term].entry->info->reads & effects::kTorqueScale) == 0) continue;
      auto column = regression_.X.col(static_cast<Eigen::Index>(j));
      const Eigen::VectorXd& y = regression_.y;
      const double square = column.squaredNorm();
      if (square > 0.0 && (y - column * (column.dot(y) / square)).norm() < kSame * y.norm()) column.setZero();
    }
  }

  // Linear parameters at given nonlinear parameters; `error_covariance` is the noise covariance. Returns the weights of
  // records that follow from the residual.
  Eigen::VectorXd solve(const NoiseCovariance& error_covariance) {
    form_regression();
    const LinearFit linear = generalised_least_squares(regression_.X, regression_.y, error_covariance);
    for (std::size_t j = 0; j < fit_.linear.size(); ++j)
      terms_[fit_.linear[j].term].values[fit_.linear[j].parameter] = linear.theta[static_cast<Eigen::Index>(j)];
    fit_.residual = linear.residual;
    return root_record_weights(data_.records(), fit_.residual);
  }

  // How friction differs between records at the present values, for which the regression is formed.
  void estimate_differences() {
    J_.resize(data_.rows(), static_cast<Eigen::Index>(fit_.linear.size() + fit_.nonlinear.size()));
    J_ << regression_.X, data_.nonlinear_columns(terms_, fit_.on_balance, fit_.nonlinear);
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(J_.cols());
    for (std::size_t j = 0; j < fit_.linear.size(); ++j)
      theta[static_cast<Eigen::Index>(j)] = terms_[fit_.linear[j].term].values[fit_.linear[j].parameter];
    friction_ = friction_torques(J_, theta, terms_, fit_.linear, fit_.nonlinear);
    torques_ = noise_weights_.asDiagonal() * friction_;
    between_ = paule_mandel(data_, torques_, noise_weights_.cwiseProduct(fit_.residual));
  }

  const RegressionProblem& data_;
  Terms& terms_;
  BalanceFit& fit_;
  Eigen::VectorXd noise_weights_;  // of the residual without the records' random effects
  RegressionProblem::Regression regression_;
  Eigen::MatrixXd J_;         // columns of linear parameters and nonlinear parameters
  Eigen::MatrixXd friction_;  // the torque of each friction group
  Eigen::MatrixXd torques_;   // the same, weighted
  RecordVariance between_;
};

void Fitting::fit_weighted() {
  const bool searches = !fit_.nonlinear.empty();
  if (searches) {
    sweep_nonlinear(data_, terms_, fit_.on_balance, fit_.root_weights);
    // Weights of the best point of a grid would be small on just those records that show where between points it lies.
    refine_nonlinear(data_, terms_, fit_.on_balance, fit_.root_weights);
  }
  // Weights and parameters depend on each other; two rounds are enough.
  for (int round = 0; round < 2; ++round) {
    fit_.root_weights = solve(fit_.root_weights);
    if (searches) refine_nonlinear(data_, terms_, fit_.on_balance, fit_.root_weights);
  }
  solve(fit_.root_weights);
  fit_.error_covariance = noise_weights_ = fit_.root_weights;
}

void Fitting::fit_generalised() {
  estimate_differences();
  const bool searches = !fit_.nonlinear.empty();
  const Terms weighted_terms = terms_;
  const Eigen::VectorXd weighted_residual = fit_.residual;
  Eigen::VectorXd generalised_weights;
  constexpr int kGeneralised = 3;
  for (int round = 0; round < kGeneralised && between_.std.size() > 0 && between_.std.maxCoeff() > 0.0; ++round) {
    noise_weights_ = root_record_weights(data_.records(), between_.left.cwiseQuotient(noise_weights_));
    fit_.error_covariance = noise_covariance(data_, noise_weights_, noise_weights_.asDiagonal() * friction_,
                                             between_.std, between_.autocorrelation_time);
    // With random effects the best nonlinear parameter of a small effect may be far from that without.
    if (searches && round == 0)
      sweep_nonlinear(data_, terms_, fit_.on_balance, fit_.error_covariance, SweepFrom::values);
    if (searches) refine_nonlinear(data_, terms_, fit_.on_balance, fit_.error_covariance);
    generalised_weights = solve(fit_.error_covariance);
    estimate_differences();
  }
  if (fit_.error_covariance.is_diagonal()) return;
  if (between_.leaves_noise) {
    fit_.root_weights = generalised_weights;
    return;
  }
  terms_ = weighted_terms;
  fit_.residual = weighted_residual;
  fit_.error_covariance = noise_weights_ = fit_.root_weights;
  form_regression();
  estimate_differences();
}

void Fitting::take_uncertainty() {
  const Eigen::VectorXd weighted = fit_.root_weights.cwiseProduct(fit_.residual);
  fit_.autocorrelation_time = autocorrelation_time(data_, weighted);
  const LinearFit joint = least_squares(J_, fit_.residual, fit_.root_weights);
  const LinearFit generalised =
      fit_.error_covariance.is_diagonal() ? joint : generalised_least_squares(J_, fit_.residual, fit_.error_covariance);
  const double freedom = std::max(1.0, static_cast<double>(data_.rows() - J_.cols()));
  fit_.covariance = generalised.unit_covariance;
  std::vector<Eigen::Index> identified;
  for (Eigen::Index j = 0; j < J_.cols(); ++j)
    if (std::isfinite(generalised.unit_covariance(j, j))) identified.push_back(j);
  // Covariance without the records' random effects, which are added below.
  const Eigen::MatrixXd columns = fit_.error_covariance.score_columns(J_(Eigen::all, identified));
  const Eigen::MatrixXd middle = newey_west(data_.records(), columns, between_.left,
                                            newey_west_lags(between_.autocorrelation_time, data_.rows())) *
                                 (static_cast<double>(data_.rows()) / freedom);
  const Eigen::MatrixXd unit = generalised.unit_covariance(identified, identified);
  fit_.covariance(identified, identified) =
      add_record_variance(between_, data_, torques_, columns, unit, unit * middle * unit);
  fit_.root_tolerance = joint.root_tolerance;
  fit_.excitation = joint.root_tolerance_of_all;
  fit_.white_variance =
      generalised.unit_covariance.diagonal() * (fit_.error_covariance.whiten(fit_.residual).squaredNorm() / freedom);
  fit_.condition_number = joint.condition_number;
}

}  // namespace

BalanceFit fit_balance(const RegressionProblem& data, Terms& terms) {
  BalanceFit fit;
  fit.balance = data.balance();
  fit.on_balance = terms_on(terms, data.balance(), data.prepared().output_signals);
  fit.linear = free_linear_parameters(terms, fit.on_balance);
  fit.nonlinear = free_nonlinear_parameters(terms, fit.on_balance);
  fit.root_weights = Eigen::VectorXd::Ones(data.rows());
  fit.error_covariance = fit.root_weights;
  if (data.empty()) return fit;
  set_grid_values(data, terms, fit.on_balance);
  Fitting fitting(data, terms, fit);
  fitting.fit_weighted();
  fitting.fit_generalised();
  fitting.take_uncertainty();
  return fit;
}

}  // namespace flexspline::estimation
