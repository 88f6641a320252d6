#include "host/engine/selection/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/common/algebra/decompositions.hpp"
#include "host/common/numbers/distributions.hpp"
#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/estimation/random_effects.hpp"
#include "host/engine/estimation/record_variance.hpp"
#include "host/engine/estimation/variable_projection.hpp"

namespace flexspline::selection {
namespace {

using estimation::MixedFit;
using estimation::RandomEffectCost;
using estimation::RecordFactors;

// R factors of all parts of the records but one.
std::vector<Eigen::MatrixXd> factors_without(const RecordFactors& factors, std::size_t out) {
  std::vector<Eigen::MatrixXd> others;
  for (const auto& of_record : factors.parts) {
    std::vector<const Eigen::MatrixXd*> parts;
    for (std::size_t f = 0; f < of_record.size(); ++f)
      if (f != out) parts.push_back(&of_record[f]);
    others.push_back(estimation::combined_factor(parts));
  }
  return others;
}

// Predicts each part of all records from the others. Only columns that the whole data determine are fitted.
std::vector<LeftOut> predict_left_out(const RecordFactors& factors, const MixedFit& whole, double tau) {
  const Eigen::Index columns = factors.columns();
  std::vector<Eigen::Index> used;
  for (Eigen::Index j = 0; j < columns; ++j)
    if (whole.linear.root_tolerance[j] >= estimation::kUndetermined) used.push_back(j);
  std::vector<LeftOut> records(factors.whole.size());
  for (std::size_t out = 0; out < kFolds; ++out) {
    const std::vector<Eigen::MatrixXd> others = factors_without(factors, out);
    std::vector<Eigen::MatrixXd> reduced;
    for (std::size_t i = 0; i < records.size(); ++i)
      reduced.push_back(
          estimation::eliminate_random_effects(others[i], whole.u, whole.effects.std, whole.effects.variance[i] * tau));
    const Eigen::MatrixXd all = estimation::combined_factor(reduced);
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(columns);
    theta(used) = algebra::PivotedQr(all(Eigen::all, used), 1e-5).solve(all.col(columns));
    for (std::size_t i = 0; i < records.size(); ++i) {
      RecordErrors seen;
      estimation::add_errors(others[i], theta, whole.u, factors.rows_of(i) - factors.rows[i][out], seen);
      const Eigen::VectorXd own = theta + whole.u * estimation::best_linear_predictions(
                                                        seen, whole.effects.std, whole.effects.variance[i] * tau);
      const Eigen::MatrixXd& part = factors.parts[i][out];
      records[i].rows += factors.rows[i][out];
      records[i].squares_of_part[out] = (part.col(columns) - part.leftCols(columns) * own).squaredNorm();
      records[i].squares += records[i].squares_of_part[out];
    }
  }
  return records;
}

// By the noise of each record; zero where `keep` is.
Eigen::VectorXd root_weights_of(const RegressionProblem& data, const Eigen::VectorXd& keep,
                                const std::vector<double>& variance) {
  Eigen::VectorXd weights(keep.size());
  for (std::size_t i = 0; i < data.records().size(); ++i) {
    const RowRange& range = data.records()[i];
    weights.segment(range.first, range.size()) = keep.segment(range.first, range.size()) / std::sqrt(variance[i]);
  }
  return weights;
}

double rows_of(const std::vector<LeftOut>& records) {
  return std::accumulate(records.begin(), records.end(), 0.0,
                         [](double sum, const LeftOut& r) { return sum + r.rows; });
}

void set_linear(Terms& terms, const std::vector<ParameterRef>& linear, const Eigen::VectorXd& theta) {
  for (std::size_t j = 0; j < linear.size(); ++j)
    terms[linear[j].term].values[linear[j].parameter] = theta[static_cast<Eigen::Index>(j)];
}

// The data of a fit with one R factor for each record.
struct Regression {
  Eigen::MatrixXd X;
  Eigen::VectorXd y;
  RecordFactors factors;
  Eigen::Index first_nonlinear = 0;
};

// The residual of `theta`, with each record's predicted random effects.
Eigen::VectorXd residual_of(const RegressionProblem& data, const Regression& regression, const Eigen::VectorXd& theta,
                            const MixedFit& mixed) {
  Eigen::VectorXd residual = regression.y - regression.X * theta;
  for (std::size_t i = 0; i < data.records().size(); ++i) {
    const RowRange& range = data.records()[i];
    const SmallVector& b = mixed.effects.predictions[i];
    if (b.size() > 0 && b.cwiseAbs().maxCoeff() > 0.0)
      residual.segment(range.first, range.size()) -=
          regression.X.middleRows(range.first, range.size()) * (mixed.u * b).cwiseQuotient(regression.factors.size);
  }
  return residual;
}

// Fits the mixed model with the number of samples that count as one by its residual's autocorrelation. Returns the fit
// and that number.
std::pair<MixedFit, double> fit_with_autocorrelation(const RegressionProblem& data, const Regression& regression,
                                                     const Eigen::VectorXd& keep, CrossValidatedFit& fit) {
  double next_tau = data.filter_autocorrelation_time(), tau = next_tau;
  MixedFit mixed;
  // The random effects depend on the autocorrelation time of the residual, which depends on the random effects:
  // iterate.
  for (int round = 0; round < 2; ++round) {
    tau = next_tau;
    mixed = estimation::fit_mixed_model(regression.factors, fit.groups, regression.first_nonlinear, tau);
    fit.theta = mixed.linear.theta.cwiseQuotient(regression.factors.size);
    fit.residual = residual_of(data, regression, fit.theta, mixed);
    fit.root_weights = root_weights_of(data, keep, mixed.effects.variance);
    fit.autocorrelation_time = estimation::autocorrelation_time(data, fit.root_weights.cwiseProduct(fit.residual));
    if (fit.groups.empty() || fit.autocorrelation_time < 1.1 * tau) break;
    next_tau = fit.autocorrelation_time;
  }
  return {std::move(mixed), tau};
}

// For a fit whose R factors are weighted with `tau` samples counting as one.
void take_covariance(const Regression& regression, const MixedFit& mixed, double tau, const Eigen::VectorXd& keep,
                     CrossValidatedFit& fit) {
  const double counted = (keep.array() > 0.0).count();
  const double freedom = counted / std::max(1.0, counted - static_cast<double>(regression.X.cols()));
  const Eigen::VectorXd& size = regression.factors.size;
  fit.covariance = size.cwiseInverse().asDiagonal() * mixed.linear.unit_covariance * size.cwiseInverse().asDiagonal() *
                   (freedom * fit.autocorrelation_time / tau);
  fit.std = (mixed.linear.unit_covariance.diagonal() * freedom * (fit.autocorrelation_time / tau))
                .cwiseSqrt()
                .cwiseQuotient(size);
}

}  // namespace

double rmse_of(const Eigen::VectorXd& residual, const Eigen::VectorXd& root_weights) {
  const double rows = (root_weights.array() > 0.0).count();
  return std::sqrt((root_weights.array() > 0.0).select(residual.array().square(), 0.0).sum() / std::max(1.0, rows));
}

double rmse_of(const std::vector<LeftOut>& records) {
  const double squares = std::accumulate(records.begin(), records.end(), 0.0,
                                         [](double sum, const LeftOut& r) { return sum + r.squares; });
  return std::sqrt(squares / std::max(1.0, rows_of(records)));
}

double standard_errors_over(const std::vector<LeftOut>& larger, const std::vector<LeftOut>& other) {
  double n = 0.0, sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < other.size(); ++i)
    for (std::size_t f = 0; f < kFolds; ++f) {
      const double of_larger = larger[i].squares_of_part[f], of_other = other[i].squares_of_part[f];
      if (of_larger == 0.0 && of_other == 0.0) continue;  // a part without samples
      const double difference = (of_larger - of_other) * other[i].rows / std::max(other[i].squares, 1e-300);
      n += 1.0;
      sum += difference;
      squares += difference * difference;
    }
  if (sum <= 0.0) return 0.0;
  const double variance = (squares - sum * sum / n) / std::max(1.0, n - 1.0);
  return sum / std::sqrt(std::max(n * variance, 1e-300));
}

CrossValidatedFit cross_validate(const RegressionProblem& data, Terms terms, const Eigen::VectorXd& keep) {
  CrossValidatedFit fit;
  const auto on_balance = estimation::terms_on(terms, data.balance(), data.prepared().output_signals);
  fit.linear = estimation::free_linear_parameters(terms, on_balance);
  const std::vector<ParameterRef> nonlinear = estimation::free_nonlinear_parameters(terms, on_balance);
  fit.groups = estimation::friction_groups(terms, fit.linear, nonlinear);
  Regression regression;
  regression.first_nonlinear = static_cast<Eigen::Index>(fit.linear.size());
  regression.y = data.target() - data.known_torque(terms, on_balance);
  if (!nonlinear.empty()) {
    // Slopes by nonlinear parameters need the linear parameters.
    const RecordFactors linear =
        estimation::record_factors(data, data.columns(terms, fit.linear), regression.y, keep, 1);
    const MixedFit first =
        estimation::fit_mixed_model(linear, fit.groups, regression.first_nonlinear, data.filter_autocorrelation_time());
    set_linear(terms, fit.linear, first.linear.theta.cwiseQuotient(linear.size));
  }
  regression.X = estimation::model_columns(data, terms);
  regression.factors = estimation::record_factors(data, regression.X, regression.y, keep, kFolds);
  const auto [mixed, tau] = fit_with_autocorrelation(data, regression, keep, fit);
  set_linear(terms, fit.linear, fit.theta);
  fit.root_tolerance = mixed.linear.root_tolerance;
  fit.random_effects = mixed.effects;
  fit.errors = estimation::record_errors(regression.factors, mixed.linear.theta, mixed.u);
  take_covariance(regression, mixed, tau, keep, fit);
  fit.left_out = predict_left_out(regression.factors, mixed, tau);
  if (!fit.groups.empty() && fit.random_effects.std.maxCoeff() > 0.0) {
    const MixedFit fixed = estimation::fit_mixed_model(regression.factors, {}, regression.first_nonlinear, tau);
    fit.fixed_effects.residual =
        regression.y - regression.X * fixed.linear.theta.cwiseQuotient(regression.factors.size);
    fit.fixed_effects.root_weights = root_weights_of(data, keep, fixed.effects.variance);
    fit.fixed_effects.left_out = predict_left_out(regression.factors, fixed, tau);
  }
  fit.terms = std::move(terms);
  return fit;
}

namespace {

// Standard deviations of `fit` for the groups of another model, by name; a group that it does not have has none.
SmallVector std_for(const std::vector<FrictionGroup>& groups, const CrossValidatedFit& fit) {
  SmallVector std = SmallVector::Zero(static_cast<Eigen::Index>(groups.size()));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (std::size_t k = 0; k < fit.groups.size(); ++k)
      if (fit.groups[k].name == groups[g].name)
        std[static_cast<Eigen::Index>(g)] = fit.random_effects.std[static_cast<Eigen::Index>(k)];
  return std;
}

}  // namespace

NoiseCovariance noise_covariance(const RegressionProblem& data, const CrossValidatedFit& fit) {
  if (fit.groups.empty()) return fit.root_weights;
  const auto first_nonlinear = static_cast<Eigen::Index>(fit.linear.size());
  const bool ratio_parameters = std::any_of(fit.groups.begin(), fit.groups.end(),
                                            [](const FrictionGroup& g) { return !g.ratio_parameters.empty(); });
  const Eigen::MatrixXd X =
      ratio_parameters ? estimation::model_columns(data, fit.terms) : data.columns(fit.terms, fit.linear);
  const Eigen::MatrixXd u = estimation::random_effect_directions(fit.groups, fit.theta.head(X.cols()),
                                                                 Eigen::VectorXd::Ones(X.cols()), first_nonlinear);
  return estimation::noise_covariance(data, fit.root_weights, fit.root_weights.asDiagonal() * (X * u),
                                      fit.random_effects.std, fit.autocorrelation_time);
}

double whitened_squares(const RegressionProblem& data, const Terms& terms, const CrossValidatedFit& fit) {
  const auto on_balance = estimation::terms_on(terms, data.balance(), data.prepared().output_signals);
  const auto linear = estimation::free_linear_parameters(terms, on_balance);
  const Eigen::VectorXd keep = (fit.root_weights.array() > 0.0).cast<double>();
  const auto [X, y] = data.regression(terms, on_balance, linear);
  const RecordFactors factors = estimation::record_factors(data, X, y, keep, 1);
  const std::vector<FrictionGroup> groups = estimation::friction_groups(terms, linear);
  const Eigen::Index columns = factors.columns();
  SmallVector std = SmallVector::Zero(static_cast<Eigen::Index>(groups.size()));
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(columns);
  double left = 0.0;
  // The groups' torques come from a fit without random effects.
  for (int round = 0; round < 2; ++round) {
    const Eigen::MatrixXd u = estimation::random_effect_directions(groups, theta, factors.size, columns);
    std::vector<Eigen::MatrixXd> reduced;
    for (std::size_t i = 0; i < factors.whole.size(); ++i)
      reduced.push_back(estimation::eliminate_random_effects(
          factors.whole[i], u, std, fit.random_effects.variance[i] * fit.autocorrelation_time));
    const Eigen::MatrixXd all = estimation::combined_factor(reduced);
    theta = algebra::PivotedQr(all.leftCols(columns), 1e-5).solve(all.col(columns));
    left = (all.col(columns) - all.leftCols(columns) * theta).squaredNorm();
    std = std_for(groups, fit);
    if (groups.empty() || std.maxCoeff() <= 0.0) break;
  }
  return left;
}

namespace {

// Noise is each record's own, as the extended model leaves it.
double fixed_effects_percent_of(const CrossValidatedFit& base, const CrossValidatedFit& extended) {
  const std::vector<LeftOut>&before = base.left_out_fixed_effects(), &after = extended.left_out_fixed_effects();
  double chi2_before = 0.0, chi2_after = 0.0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const double noise = std::max(after[i].squares / std::max(1.0, after[i].rows), 1e-300);
    chi2_before += before[i].squares / noise;
    chi2_after += after[i].squares / noise;
  }
  return chi2_before > 0.0 ? 100.0 * (1.0 - chi2_after / chi2_before) : 0.0;
}

}  // namespace

// The left-out squares S_i of a record with n_i samples give the deviance n_i/tau ln(S_i/n_i), with the variance of its
// noise at its maximum of the likelihood: the term S_i/(n_i variance) is one then, and cancels. Below the least
// variance that counts as noise it is left out as well, so that a fit does not gain by a record that is nearly exact.
LikelihoodGain likelihood_gain(const CrossValidatedFit& base, const CrossValidatedFit& extended, double added) {
  const double tau = std::max(1.0, std::min(base.autocorrelation_time, extended.autocorrelation_time));
  std::vector<double> after;
  for (const LeftOut& r : extended.left_out) after.push_back(r.squares / std::max(1.0, r.rows));
  const double least = std::max(estimation::least_variance_of(after), 1e-300);
  double ratio = 0.0, chi2_before = 0.0, chi2_after = 0.0;
  const auto noise = [&](const LeftOut& r) { return std::max(r.squares / std::max(1.0, r.rows), least); };
  // Minus twice the log likelihood: what the samples leave, and what the records' random effects cost.
  const auto deviance = [&](const CrossValidatedFit& fit, std::size_t i, double& chi2) {
    const LeftOut& r = fit.left_out[i];
    RandomEffectCost cost;
    if (i < fit.errors.size())
      cost = estimation::random_effect_cost(fit.errors[i], fit.random_effects.std, noise(r) * tau);
    chi2 += r.squares / noise(extended.left_out[i]) + tau * cost.squares;
    return r.rows / tau * std::log(noise(r)) + cost.squares + cost.log_det;
  };
  for (std::size_t i = 0; i < after.size(); ++i)
    ratio += deviance(base, i, chi2_before) - deviance(extended, i, chi2_after);
  const double effective = rows_of(base.left_out) / tau;
  LikelihoodGain gain;
  gain.score = ratio - added * std::log(std::max(2.0, effective));
  gain.chi2_percent = chi2_before > 0.0 ? 100.0 * (1.0 - chi2_after / chi2_before) : 0.0;
  gain.fixed_effects_percent = fixed_effects_percent_of(base, extended);
  gain.p_value = ratio > 0.0 ? numbers::chi_squared_above(std::max(1.0, added), ratio) : 1.0;
  return gain;
}

}  // namespace flexspline::selection
