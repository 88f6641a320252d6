// Figures of a comparison of one signal with its model.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::comparison {

// Value of a figure that is undefined or not computed.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Sums over samples of a measured signal y and its error e = y - yhat. Figures are NaN where they have no meaning: no
// samples, or a signal that does not vary.
class Score {
 public:
  void add(double measured, double error);
  void add(const Score& other);

  std::size_t samples() const { return samples_; }
  double rmse() const;
  double nrmse() const;        // rmse / std(y)
  double fit_percent() const;  // 100 (1 - |e| / |y - mean(y)|)
  double vaf_percent() const;  // 100 (1 - var(e) / var(y))
  double max_abs() const;      // largest |e|

 private:
  double variance() const;

  // Means and sums of squares about them, updated as samples come (Chan, Golub, LeVeque 1979): positions may be far
  // from zero.
  std::size_t samples_ = 0;
  double mean_ = 0.0, spread_ = 0.0;
  double error_mean_ = 0.0, error_spread_ = 0.0;
  double error_squared_ = 0.0;
  double largest_ = 0.0;
};

}  // namespace flexspline::comparison
