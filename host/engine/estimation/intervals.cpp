#include "host/engine/estimation/intervals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/variable_projection.hpp"

namespace flexspline::estimation {
namespace {

constexpr double kLikelihoodRatio = 3.84;  // 95 % point of chi-square with one degree of freedom

Estimate* estimate_of(Identification& identification, const ParameterRef& ref) {
  for (Estimate& e : identification.estimates)
    if (e.ref == ref && !e.fixed) return &e;
  return nullptr;
}

double natural(const Terms& terms, const ParameterRef& ref) {
  const Term& term = terms[ref.term];
  return catalogue::natural(*term.entry, term.values)[ref.parameter];
}

// Fits all that is free on the balance from the present values of the terms, and returns the sum of squares of white
// errors.
double fit_rest(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& on_balance,
                const NoiseCovariance& error_covariance) {
  refine_nonlinear(data, terms, on_balance, error_covariance);
  const std::vector<ParameterRef> linear = free_linear_parameters(terms, on_balance);
  const auto [X, y] = data.regression(terms, on_balance, linear);
  const LinearFit fit = generalised_least_squares(X, y, error_covariance);
  for (std::size_t j = 0; j < linear.size(); ++j)
    terms[linear[j].term].values[linear[j].parameter] = fit.theta[static_cast<Eigen::Index>(j)];
  return error_covariance.whiten(fit.residual).squaredNorm();
}

// The value of one parameter at which the sum of squares, with all others fitted, has grown by `allowed`; `side` -1
// or 1.
std::optional<double> end_of_profile(const RegressionProblem& data, const Terms& best, const BalanceFit& fit,
                                     const ParameterRef& ref, double step, double low, double high, double least,
                                     double allowed, int side) {
  const double start = best[ref.term].values[ref.parameter];
  Terms terms = best;
  terms[ref.term].known[ref.parameter] = 1;
  const auto excess_at = [&](double value) {
    terms[ref.term].values[ref.parameter] = value;
    return fit_rest(data, terms, fit.on_balance, fit.error_covariance) - least - allowed;
  };
  // Outward in growing steps, then by halving.
  double inside = start, outside = start;
  bool found = false;
  for (int k = 0; k < 8 && !found; ++k, step *= 2.0) {
    outside = std::clamp(inside + side * step, low, high);
    if (outside == inside) return std::nullopt;
    found = excess_at(outside) > 0.0;
    if (!found) inside = outside;
  }
  if (!found) return std::nullopt;
  for (int k = 0; k < 7; ++k) {
    const double middle = 0.5 * (inside + outside);
    (excess_at(middle) > 0.0 ? outside : inside) = middle;
  }
  terms[ref.term].values[ref.parameter] = 0.5 * (inside + outside);
  fit_rest(data, terms, fit.on_balance, fit.error_covariance);
  return natural(terms, ref);
}

std::vector<ParameterRef> parameter_refs(const BalanceFit& fit) {
  std::vector<ParameterRef> refs = fit.linear;
  refs.insert(refs.end(), fit.nonlinear.begin(), fit.nonlinear.end());
  return refs;
}

}  // namespace

void profile(Identification& identification, const Progress& progress) {
  for (std::size_t b = 0; b < identification.fits.size(); ++b) {
    const BalanceFit& fit = identification.fits[b];
    const RegressionProblem& data = identification.data[b];
    Terms best = identification.terms;
    const double least = fit_rest(data, best, fit.on_balance, fit.error_covariance);
    const auto refs = parameter_refs(fit);
    const double freedom = std::max(1.0, static_cast<double>(data.rows()) - static_cast<double>(refs.size()));
    for (std::size_t j = 0; j < refs.size(); ++j) {
      Estimate* estimate = estimate_of(identification, refs[j]);
      const double variance = fit.covariance(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(j));
      if (!estimate || !estimate->identifiable || !std::isfinite(variance)) continue;
      // Autocorrelation widens a profile as it widens the standard error.
      const double allowed =
          kLikelihoodRatio * least / freedom * variance / fit.white_variance[static_cast<Eigen::Index>(j)];
      const Term& term = best[refs[j].term];
      progress(fmt::format("profile of {}.{}", term.id, term.entry->parameters[refs[j].parameter].name));
      double low = term.entry->parameters[refs[j].parameter].low;
      double high = term.entry->parameters[refs[j].parameter].high;
      if (j >= fit.linear.size()) {
        const ParameterRange range = parameter_range(data, term, refs[j].parameter);
        low = range.low;
        high = range.high;
      }
      const double step = std::max(std::sqrt(variance), 1e-9 * std::abs(estimate->value));
      const auto a = end_of_profile(data, best, fit, refs[j], step, low, high, least, allowed, -1);
      const auto b_end = end_of_profile(data, best, fit, refs[j], step, low, high, least, allowed, 1);
      estimate->low = a;
      estimate->high = b_end;
      if (a && b_end && *a > *b_end) std::swap(estimate->low, estimate->high);
      if (!a || !b_end)
        identification.warnings.push_back(fmt::format("{}.{}: the data give no {} bound within its range; record {}",
                                                      term.id, term.entry->parameters[refs[j].parameter].name,
                                                      !a && !b_end ? ""
                                                      : !a         ? "lower"
                                                                   : "upper",
                                                      term.entry->info->separated_by));
    }
  }
}

void bootstrap(Identification& identification, int replicates, std::uint64_t seed, const Progress& progress) {
  std::mt19937_64 random(seed);
  for (std::size_t b = 0; b < identification.fits.size(); ++b) {
    const BalanceFit& fit = identification.fits[b];
    const RegressionProblem& data = identification.data[b];
    const auto refs = parameter_refs(fit);
    if (refs.empty()) continue;
    // Blocks are long against what neighbours have in common, and there are at least twenty where there are so many
    // samples.
    const auto rows = static_cast<double>(data.rows());
    const auto length =
        static_cast<Eigen::Index>(std::clamp(10.0 * fit.autocorrelation_time, 1.0, std::max(1.0, rows / 20.0)));
    std::vector<RowRange> blocks;
    for (const RowRange& range : data.records())
      for (Eigen::Index first = range.first; first < range.last; first += length)
        blocks.push_back({range.record, first, std::min(first + length, range.last)});
    std::vector<std::vector<double>> drawn(refs.size());
    for (int r = 0; r < replicates; ++r) {
      if (r % 20 == 0) progress(fmt::format("bootstrap: {} of {}", r, replicates));
      std::vector<int> times(blocks.size(), 0);
      for (std::size_t k = 0; k < blocks.size(); ++k) ++times[random() % blocks.size()];
      Eigen::VectorXd counts(data.rows());
      for (std::size_t k = 0; k < blocks.size(); ++k)
        counts.segment(blocks[k].first, blocks[k].size()).setConstant(std::sqrt(static_cast<double>(times[k])));
      Terms terms = identification.terms;
      fit_rest(data, terms, fit.on_balance, fit.error_covariance.with_counts(counts));
      for (std::size_t j = 0; j < refs.size(); ++j) drawn[j].push_back(natural(terms, refs[j]));
    }
    for (std::size_t j = 0; j < refs.size(); ++j) {
      Estimate* estimate = estimate_of(identification, refs[j]);
      if (!estimate || !estimate->identifiable || drawn[j].empty()) continue;
      std::sort(drawn[j].begin(), drawn[j].end());
      const auto at = [&](double share) {
        return drawn[j][static_cast<std::size_t>(std::lround(share * static_cast<double>(drawn[j].size() - 1)))];
      };
      estimate->low = at(0.025);
      estimate->high = at(0.975);
    }
  }
}

}  // namespace flexspline::estimation
