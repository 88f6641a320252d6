#include "host/engine/estimation/by_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/estimation/least_squares.hpp"

namespace flexspline::estimation {
namespace {

// An experiment counts where its standard error is less than a fifth of the value. That it is collinear with others in
// the experiment is in that error already.
constexpr double kOwnError = 0.2;

double value_of(const AloneFit& fit, const Combination& c) {
  return fit.theta[c.first] + (c.second ? c.sign * fit.theta[*c.second] : 0.0);
}

double std_of(const AloneFit& fit, const Combination& c) {
  double variance = fit.covariance(c.first, c.first);
  if (c.second) variance += fit.covariance(*c.second, *c.second) + 2.0 * c.sign * fit.covariance(c.first, *c.second);
  return std::sqrt(std::max(0.0, variance));
}

double share_of(const AloneFit& fit, const Combination& c) {
  const double own = fit.root_tolerance[c.first];
  return c.second ? std::min(own, fit.root_tolerance[*c.second]) : own;
}

// The usual size of a value: an experiment in which the parameter is small, but is determined well for its usual size,
// counts too. Left out, a value that disagrees by being near zero would not show.
double median_size(const std::vector<AloneFit>& alone, const Combination& c) {
  std::vector<double> sizes;
  for (const AloneFit& fit : alone)
    if (fit.too_short.empty() && share_of(fit, c) > kUndetermined) sizes.push_back(std::abs(value_of(fit, c)));
  if (sizes.empty()) return 0.0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle;
}

struct Moments {
  double mean = 0.0, deviation = 0.0, chi2 = 0.0;
};

Moments moments_of(const ByExperiment& e) {
  const auto n = static_cast<double>(e.counted());
  Moments m;
  double squares = 0.0;
  for (const ExperimentValue& v : e.per_experiment)
    if (v.value) m.mean += *v.value / n;
  for (const ExperimentValue& v : e.per_experiment) {
    if (!v.value) continue;
    const double off = *v.value - m.mean;
    squares += off * off;
    const double std = v.std.value_or(0.0);
    if (off != 0.0) m.chi2 += std > 0.0 ? off * off / (std * std) : std::numeric_limits<double>::infinity();
  }
  m.deviation = std::sqrt(squares / (n - 1.0));
  return m;
}

}  // namespace

std::size_t ByExperiment::counted() const {
  return static_cast<std::size_t>(std::count_if(per_experiment.begin(), per_experiment.end(),
                                                [](const ExperimentValue& v) { return v.value.has_value(); }));
}

void summarise(ByExperiment& e) {
  e.average.reset();
  e.spread_percent.reset();
  e.reliable.reset();
  const std::size_t n = e.counted();
  if (n < 2) return;
  const Moments m = moments_of(e);
  e.average = m.mean;
  // An average that is zero within its error has no meaningful relative spread, unless the experiments differ by more
  // than their own errors explain: then it is the disagreement that makes the average uncertain, and it is said.
  const auto freedom = static_cast<double>(n - 1);
  const bool average_is_zero = std::abs(m.mean) <= 2.0 * m.deviation / std::sqrt(freedom + 1.0);
  const bool differ = m.chi2 > numbers::chi_squared_quantile(freedom, 0.95);
  if (m.mean == 0.0 || (average_is_zero && !differ)) return;
  e.spread_percent = 100.0 * m.deviation / std::abs(m.mean);
  if (n >= kFewestForReliable) e.reliable = *e.spread_percent <= kReliableSpreadPercent;
}

ByExperiment by_experiment(const std::vector<AloneFit>& alone, const Combination& combination) {
  const double usual = median_size(alone, combination);
  ByExperiment e;
  for (const AloneFit& fit : alone) {
    ExperimentValue v;
    v.name = fit.name;
    if (!fit.too_short.empty()) {
      v.left_out = fit.too_short;
    } else if (share_of(fit, combination) <= kUndetermined) {
      v.left_out = "not distinguished from the other parameters in it";
    } else {
      const double value = value_of(fit, combination), std = std_of(fit, combination);
      v.std = std;
      if (std < kOwnError * std::max(std::abs(value), usual))
        v.value = value;
      else
        v.left_out = fmt::format("its own standard error is above {:.0f} %", 100.0 * kOwnError);
    }
    e.per_experiment.push_back(std::move(v));
  }
  summarise(e);
  return e;
}

}  // namespace flexspline::estimation
