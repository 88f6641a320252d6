// What a count among simulated drives says of the rate, and what limit a tail of scores asks for.
#pragma once

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <cstddef>
#include <vector>

namespace flexspline::tests {

// Exact two-sided 95 % interval of a share (Clopper and Pearson 1934) of which `count` of `total` were seen.
struct Interval {
  double low = 0.0, high = 1.0;
};
inline Interval exact_interval(std::size_t count, std::size_t total) {
  using Beta = boost::math::beta_distribution<double>;
  constexpr double kTail = 0.025;
  Interval interval;
  const auto k = static_cast<double>(count), n = static_cast<double>(total);
  if (count > 0) interval.low = boost::math::quantile(Beta(k, n - k + 1.0), kTail);
  if (count < total) interval.high = boost::math::quantile(Beta(k + 1.0, n - k), 1.0 - kTail);
  return interval;
}

// A score that nothing passes in all but `share` of the sets with nothing hidden: the largest scores, above nine tenths
// of them, follow an exponential law as tails of log likelihood ratios do; its mean excess is taken at its upper 95 %
// bound. At least twenty scores.
inline double threshold_from(std::vector<double> scores, double share) {
  std::sort(scores.begin(), scores.end());
  const std::size_t tail = std::max<std::size_t>(scores.size() / 10, 1);
  const double start = scores[scores.size() - tail - 1];
  double excess = 0.0;
  for (std::size_t k = scores.size() - tail; k < scores.size(); ++k) excess += scores[k] - start;
  const boost::math::chi_squared_distribution<double> sum(2.0 * static_cast<double>(tail));
  const double scale = 2.0 * excess / boost::math::quantile(sum, 0.05);
  const double beyond = static_cast<double>(tail) / static_cast<double>(scores.size());
  return start + scale * std::log(beyond / share);
}

}  // namespace flexspline::tests
