#include "host/common/signals/autocorrelation.hpp"

#include <algorithm>
#include <cmath>

#include "host/common/signals/fft.hpp"

namespace flexspline::signals {
namespace {

constexpr double kSokalWindow = 5.0;

struct Pooled {
  std::vector<double> products;  // by lag
  std::vector<std::size_t> pairs;
};

Pooled pool_products(const std::vector<std::span<const double>>& segments, std::size_t max_lag) {
  std::size_t samples = 0, longest = 0;
  double sum = 0.0, square = 0.0;
  for (const auto& s : segments) {
    samples += s.size();
    longest = std::max(longest, s.size());
    for (const double v : s) {
      sum += v;
      square += v * v;
    }
  }
  Pooled pooled;
  if (samples < 2) return pooled;
  const double mean = sum / static_cast<double>(samples);
  const std::size_t lags = std::min(max_lag, longest - 1);
  pooled.products.assign(lags + 1, 0.0);
  pooled.pairs.assign(lags + 1, 0);
  std::vector<double> centred;
  for (const auto& s : segments) {
    if (s.empty()) continue;
    centred.assign(s.begin(), s.end());
    for (double& v : centred) v -= mean;
    const std::size_t own = std::min(lags, s.size() - 1);
    const std::vector<double> products = lagged_products(centred, own);
    for (std::size_t k = 0; k <= own; ++k) {
      pooled.products[k] += products[k];
      pooled.pairs[k] += s.size() - k;
    }
  }
  // What is left of a constant is rounding.
  if (!(pooled.products[0] > 1e-24 * square)) pooled.products.clear();
  return pooled;
}

}  // namespace

std::vector<double> autocorrelation(std::span<const double> signal, std::size_t max_lag) {
  std::vector<double> rho(max_lag + 1, 0.0);
  rho[0] = 1.0;
  const Pooled pooled = pool_products({signal}, max_lag);
  for (std::size_t k = 1; k < pooled.products.size(); ++k) rho[k] = pooled.products[k] / pooled.products[0];
  return rho;
}

double integrated_autocorrelation_time(const std::vector<std::span<const double>>& segments, std::size_t max_lag) {
  const Pooled pooled = pool_products(segments, max_lag);
  if (pooled.products.empty()) return 1.0;
  const double variance = pooled.products[0] / static_cast<double>(pooled.pairs[0]);
  double tau = 1.0;
  for (std::size_t k = 1; k < pooled.products.size(); ++k) {
    tau += 2.0 * pooled.products[k] / (static_cast<double>(pooled.pairs[k]) * variance);
    if (static_cast<double>(k) >= kSokalWindow * tau) break;
  }
  return std::max(1.0, tau);
}

double integrated_autocorrelation_time(std::span<const double> residual, std::size_t max_lag) {
  return integrated_autocorrelation_time(std::vector<std::span<const double>>{residual}, max_lag);
}

}  // namespace flexspline::signals
