#include "host/engine/estimation/mixed_model.hpp"

#include <algorithm>

namespace flexspline::estimation {
namespace {

std::vector<double> raw_variances(const std::vector<RecordErrors>& records) {
  std::vector<double> variances;
  for (const RecordErrors& r : records) variances.push_back(r.ee / std::max(1.0, r.rows));
  return variances;
}

// Two starts: all differences between records as noise, or the largest random effects that are allowed.
enum class Start { all_noise, largest_effects };

MixedFit fit_from(Start start, const RecordFactors& factors, const std::vector<FrictionGroup>& groups,
                  Eigen::Index first_nonlinear, double tau) {
  MixedFit fit;
  const Eigen::Index columns = factors.columns();
  const auto solve = [&] {
    std::vector<Eigen::MatrixXd> reduced;
    for (std::size_t i = 0; i < factors.whole.size(); ++i)
      reduced.push_back(
          fit.effects.variance.empty()
              ? factors.whole[i]
              : eliminate_random_effects(factors.whole[i], fit.u, fit.effects.std, fit.effects.variance[i] * tau));
    const Eigen::MatrixXd all = combined_factor(reduced);
    fit.linear = least_squares(all.leftCols(columns), all.col(columns), Eigen::VectorXd::Ones(all.rows()));
    fit.u = random_effect_directions(groups, fit.linear.theta, factors.size, first_nonlinear);
  };
  solve();
  if (start == Start::largest_effects) {
    const std::vector<RecordErrors> errors = record_errors(factors, fit.linear.theta, fit.u);
    fit.effects = largest_random_effects(errors, tau, least_variance_of(raw_variances(errors)));
    solve();
  }
  // Parameters, random effects and noise depend on each other.
  constexpr int kMostRounds = 12;
  constexpr double kSame = 0.02;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<RecordErrors> errors = record_errors(factors, fit.linear.theta, fit.u);
    // The limit of the noise follows the residual without random effects.
    const double least = least_variance_of(fit.effects.variance.empty() ? raw_variances(errors) : fit.effects.variance);
    const SmallVector before = fit.effects.std;
    fit.effects = fit_random_effects(errors, tau, least, fit.effects.variance);
    solve();
    if (round > 1 && (groups.empty() || (fit.effects.std - before).cwiseAbs().maxCoeff() <=
                                            kSame * fit.effects.std.cwiseAbs().maxCoeff()))
      break;
  }
  return fit;
}

}  // namespace

MixedFit fit_mixed_model(const RecordFactors& factors, const std::vector<FrictionGroup>& groups,
                         Eigen::Index first_nonlinear, double tau) {
  MixedFit fit = fit_from(Start::all_noise, factors, groups, first_nonlinear, tau);
  if (groups.empty()) return fit;
  MixedFit other = fit_from(Start::largest_effects, factors, groups, first_nonlinear, tau);
  return other.deviance() < fit.deviance() ? other : fit;
}

std::vector<RecordErrors> record_errors(const RecordFactors& factors, const Eigen::VectorXd& theta,
                                        const Eigen::MatrixXd& u) {
  std::vector<RecordErrors> records(factors.whole.size());
  for (std::size_t i = 0; i < records.size(); ++i)
    add_errors(factors.whole[i], theta, u, factors.rows_of(i), records[i]);
  return records;
}

double least_variance_of(std::vector<double> variances) {
  if (variances.empty()) return 0.0;
  const auto middle = variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  return 0.01 * *middle;
}

Eigen::MatrixXd combined_factor(const std::vector<Eigen::MatrixXd>& reduced) {
  std::vector<const Eigen::MatrixXd*> blocks;
  for (const Eigen::MatrixXd& r : reduced) blocks.push_back(&r);
  return combined_factor(blocks);
}

}  // namespace flexspline::estimation
