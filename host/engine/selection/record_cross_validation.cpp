#include "host/engine/selection/record_cross_validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/estimation/variable_projection.hpp"

namespace flexspline::selection {
namespace {

constexpr std::size_t kMostFolds = 6;
// Relative change of the squares that ends the search for nonlinear parameters: far below what decides.
constexpr double kSameSquaresOfRecords = 1e-4;

// A model fitted on the samples in `keep`; nonlinear parameters start at the values from all records.
CrossValidatedFit fit_without(const RegressionProblem& data, const Terms& terms, const Eigen::VectorXd& keep) {
  CrossValidatedFit fit = cross_validate(data, terms, keep);
  const auto on_balance = estimation::terms_on(fit.terms, data.balance(), data.prepared().output_signals);
  if (estimation::free_nonlinear_parameters(fit.terms, on_balance).empty()) return fit;
  Terms refined = fit.terms;
  estimation::refine_nonlinear(data, refined, on_balance, noise_covariance(data, fit), kSameSquaresOfRecords);
  return cross_validate(data, std::move(refined), keep);
}

// Squares that a fit leaves in a record that it has not seen, the record's own random effects predicted from its
// samples.
double squares_of(const RegressionProblem& data, const CrossValidatedFit& fit, const RowRange& range,
                  double noise_variance) {
  const Eigen::VectorXd e = fit.residual.segment(range.first, range.size());
  if (fit.groups.empty() || fit.random_effects.std.maxCoeff() <= 0.0) return e.squaredNorm();
  const Eigen::MatrixXd X = estimation::model_columns(data, fit.terms).middleRows(range.first, range.size());
  const Eigen::MatrixXd Z =
      X * estimation::random_effect_directions(fit.groups, fit.theta.head(X.cols()), Eigen::VectorXd::Ones(X.cols()),
                                               static_cast<Eigen::Index>(fit.linear.size()));
  const RecordErrors errors{static_cast<double>(range.size()), e.squaredNorm(), Z.transpose() * e, Z.transpose() * Z};
  return (e - Z * estimation::best_linear_predictions(errors, fit.random_effects.std, noise_variance)).squaredNorm();
}

// Empty where a candidate carries over.
std::string why_not(const BalanceSearch& search, const CandidateFit& candidate) {
  if (is_within_floor_of_few_records(search))
    return "the error is within 30 % of the noise, and fewer than three records do not show that it carries over";
  // On the motor's balance stability selection splits the records into halves.
  if (search.data->balance() == estimation::Balance::motor) return {};
  const RecordCrossValidation carried = cross_validate_by_record(search, candidate);
  if (!carried.is_refuted() && (!search.floor || search.at_floor(candidate.fit) || carried.is_certain())) return {};
  return fmt::format("of the records left out of the fit it predicts {} worse than the model alone and {} better{}",
                     carried.worse, carried.better,
                     carried.is_refuted() ? "" : ", too few to be sure with an error that stays above the noise");
}

}  // namespace

bool RecordCrossValidation::is_refuted() const {
  return better < kPolicy.named_frequency * (better + worse);
}

bool RecordCrossValidation::is_certain() const {
  const int all = better + worse;
  if (better == 0) return false;
  // Better by chance in so many of all records or more.
  return numbers::binomial_at_least(better, all, 0.5) < kPolicy.sign_test_p_value;
}

RecordCrossValidation cross_validate_by_record(const BalanceSearch& search, const CandidateFit& candidate) {
  const std::vector<RowRange>& ranges = search.data->records();
  RecordCrossValidation result;
  if (ranges.size() < estimation::kFewestRecords || is_each_records_own(*candidate.model.entry)) return result;
  const std::size_t folds = std::min(kMostFolds, ranges.size());
  // Twice the log-likelihood ratio of each record; zero where it does not count.
  std::vector<double> gains(ranges.size(), 0.0);
  const RegressionProblem data = search.data->decimated();
  estimation::in_parallel(folds, [&](std::size_t fold) {
    Eigen::VectorXd keep = search.keep;
    for (std::size_t i = fold; i < ranges.size(); i += folds) keep.segment(ranges[i].first, ranges[i].size()).setZero();
    if (keep.maxCoeff() <= 0.0) return;
    const CrossValidatedFit with = fit_without(data, candidate.fit.terms, keep);
    const CrossValidatedFit without = fit_without(data, search.base.terms, keep);
    // An effect that only a few records show is not identified by the others.
    if (likelihood_gain(without, with, candidate.model.added).score < kPolicy.named_score) return;
    for (std::size_t i = fold; i < ranges.size(); i += folds) {
      const double tau = std::max(1.0, search.base.autocorrelation_time);
      const double noise = candidate.fit.random_effects.variance[i] * tau;
      const double before = squares_of(data, without, ranges[i], noise),
                   after = squares_of(data, with, ranges[i], noise);
      gains[i] =
          static_cast<double>(ranges[i].size()) / tau * std::log(std::max(before, 1e-300) / std::max(after, 1e-300));
    }
  });
  for (const double gain : gains) {
    result.better += gain > kPolicy.least_gain ? 1 : 0;
    result.worse += gain < -kPolicy.least_gain ? 1 : 0;
  }
  return result;
}

bool is_within_floor_of_few_records(const BalanceSearch& search) {
  return search.at_floor(search.base) && search.data->records().size() < estimation::kFewestRecords;
}

void check_by_record(const BalanceSearch& search, std::vector<CandidateFit>& candidates) {
  while (!candidates.empty() && passes(candidates.front())) {
    CandidateFit& first = candidates.front();
    first.why_not = why_not(search, first);
    if (first.why_not.empty()) return;
    first.admissible = false;
    sort_candidates(search, candidates);
  }
}

}  // namespace flexspline::selection
