#include "tests/worlds/machines/signal.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace flexspline::worlds::machines {

Signal smoothed(const Signal& x, std::size_t width) {
  const std::size_t n = std::max<std::size_t>(3, width);
  Signal window(n);
  for (std::size_t k = 0; k < n; ++k)
    window[k] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(k + 1) / static_cast<double>(n + 1));
  const double area = std::accumulate(window.begin(), window.end(), 0.0);
  for (double& v : window) v /= area;
  Signal padded(n, x.front());
  padded.insert(padded.end(), x.begin(), x.end());
  padded.insert(padded.end(), n, x.back());
  Signal out(x.size(), 0.0);
  // The window is symmetric, so that convolution and correlation are the same.
  for (std::size_t k = 0; k < x.size(); ++k)
    out[k] = std::inner_product(window.begin(), window.end(),
                                padded.begin() + static_cast<std::ptrdiff_t>(k + n - n / 2), 0.0);
  return out;
}

Signal derivative(const Signal& x, double rate_hz) {
  Signal out(x.size(), 0.0);
  for (std::size_t k = 1; k + 1 < x.size(); ++k) out[k] = 0.5 * rate_hz * (x[k + 1] - x[k - 1]);
  out.front() = rate_hz * (x[1] - x[0]);
  out.back() = rate_hz * (x[x.size() - 1] - x[x.size() - 2]);
  return out;
}

ZeroPhaseLowPass::ZeroPhaseLowPass(double cutoff_hz, double rate_hz) {
  const double k = std::tan(std::numbers::pi * cutoff_hz / rate_hz);
  const double scale = 1.0 / (1.0 + std::numbers::sqrt2 * k + k * k);
  b0_ = b2_ = k * k * scale;
  b1_ = 2.0 * b0_;
  a1_ = 2.0 * (k * k - 1.0) * scale;
  a2_ = (1.0 - std::numbers::sqrt2 * k + k * k) * scale;
}

Signal ZeroPhaseLowPass::once(const Signal& x) const {
  // Starts as if the first value had been there for ever.
  double z1 = x.front() * (1.0 - b0_), z2 = x.front() * (b2_ - a2_);
  Signal out(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    out[k] = b0_ * x[k] + z1;
    z1 = b1_ * x[k] - a1_ * out[k] + z2;
    z2 = b2_ * x[k] - a2_ * out[k];
  }
  return out;
}

Signal ZeroPhaseLowPass::operator()(const Signal& x) const {
  // The ends are continued by their mirror images through the end point.
  const std::size_t more = std::min<std::size_t>(9, x.size() - 1);
  Signal y;
  y.reserve(x.size() + 2 * more);
  for (std::size_t k = more; k > 0; --k) y.push_back(2.0 * x.front() - x[k]);
  y.insert(y.end(), x.begin(), x.end());
  for (std::size_t k = 1; k <= more; ++k) y.push_back(2.0 * x.back() - x[x.size() - 1 - k]);
  y = once(y);
  std::reverse(y.begin(), y.end());
  y = once(y);
  std::reverse(y.begin(), y.end());
  const auto first = y.begin() + static_cast<std::ptrdiff_t>(more);
  return Signal(first, first + static_cast<std::ptrdiff_t>(x.size()));
}

Signal coloured_noise(std::size_t size, double rate_hz, double corner_hz, Dice& dice) {
  const double keep = std::exp(-2.0 * std::numbers::pi * corner_hz / rate_hz), drive = std::sqrt(1.0 - keep * keep);
  Signal out(size);
  double value = dice.normal();
  for (double& v : out) v = value = keep * value + drive * dice.normal();
  return out;
}

Signal scaled(Signal x, double factor) {
  for (double& v : x) v *= factor;
  return x;
}

double rms(const Signal& x) {
  const double squares = std::inner_product(x.begin(), x.end(), x.begin(), 0.0);
  return x.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(x.size()));
}

double standard_deviation(const Signal& x) {
  const double mean = std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
  Signal rest = x;
  for (double& v : rest) v -= mean;
  return rms(rest);
}

double rms_after_least_squares(std::vector<Signal> columns, Signal target) {
  // Modified Gram-Schmidt; a column that depends on those before it is left out.
  constexpr double kDependent = 1e-9;
  const auto remove = [](const Signal& direction, Signal& from) {
    const double share = std::inner_product(direction.begin(), direction.end(), from.begin(), 0.0);
    for (std::size_t k = 0; k < from.size(); ++k) from[k] -= share * direction[k];
  };
  for (std::size_t j = 0; j < columns.size(); ++j) {
    Signal& column = columns[j];
    const double before = rms(column);
    for (std::size_t i = 0; i < j; ++i) remove(columns[i], column);
    const double after = rms(column);
    const double scale =
        after > kDependent * before ? 1.0 / (after * std::sqrt(static_cast<double>(column.size()))) : 0.0;
    for (double& v : column) v *= scale;
    remove(column, target);
  }
  return rms(target);
}

}  // namespace flexspline::worlds::machines
