#include "host/engine/comparison/score.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::comparison {
void Score::add(double measured, double error) {
  Score one;
  one.samples_ = 1;
  one.mean_ = measured;
  one.error_mean_ = error;
  one.error_squared_ = error * error;
  one.largest_ = std::abs(error);
  add(one);
}

void Score::add(const Score& other) {
  if (other.samples_ == 0) return;
  const auto a = static_cast<double>(samples_), b = static_cast<double>(other.samples_), n = a + b;
  const double step = other.mean_ - mean_, error_step = other.error_mean_ - error_mean_;
  spread_ += other.spread_ + step * step * a * b / n;
  error_spread_ += other.error_spread_ + error_step * error_step * a * b / n;
  mean_ += step * b / n;
  error_mean_ += error_step * b / n;
  error_squared_ += other.error_squared_;
  largest_ = std::max(largest_, other.largest_);
  samples_ += other.samples_;
}

double Score::variance() const {
  const double v = samples_ > 0 ? spread_ / static_cast<double>(samples_) : 0.0;
  return v > 0.0 ? v : kUnknown;
}

double Score::rmse() const {
  return samples_ > 0 ? std::sqrt(error_squared_ / static_cast<double>(samples_)) : kUnknown;
}
double Score::nrmse() const {
  return rmse() / std::sqrt(variance());
}
double Score::fit_percent() const {
  return 100.0 * (1.0 - nrmse());
}
double Score::vaf_percent() const {
  return 100.0 * (1.0 - error_spread_ / static_cast<double>(std::max<std::size_t>(1, samples_)) / variance());
}
double Score::max_abs() const {
  return samples_ > 0 ? largest_ : kUnknown;
}

}  // namespace flexspline::comparison
