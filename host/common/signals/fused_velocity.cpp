#include "host/common/signals/fused_velocity.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "host/common/signals/butterworth.hpp"
#include "host/common/signals/differentiate.hpp"

namespace flexspline::signals {
namespace {

// A crossover that the signal is long enough for.
constexpr double kPeriods = 4.0;
// Above so much of the cut-off little is left to be gained.
constexpr double kHighestCrossover = 0.5;
constexpr double kMostGainError = 0.05;
constexpr double kMostLagSamples = 2.0;
// A velocity that was smoothed has less of the fast motion than the position shows.
constexpr double kLeastFastGain = 0.8, kLeastGain = 0.5;
constexpr std::size_t kFewest = 64;

struct Relation {
  double gain = 1.0, lag_s = 0.0;
};

// Of the measured velocity to the derivative where both have little noise; what a motion is too uniform to show is
// taken for none. `independent`: samples that are. Nothing where the two differ by more than noise and rounding make.
std::optional<Relation> relation_of(const std::vector<double>& derivative, const std::vector<double>& measured,
                                    std::size_t edge, double independent, double sample_s) {
  const std::vector<double> slope = central_derivative(derivative, sample_s);
  const auto rows = static_cast<Eigen::Index>(derivative.size() - 2 * edge);
  Eigen::MatrixX3d x(rows, 3);
  Eigen::VectorXd y(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const std::size_t at = static_cast<std::size_t>(k) + edge;
    x.row(k) << derivative[at], -slope[at], 1.0;
    y[k] = measured[at];
  }
  const Eigen::Vector3d scale = x.colwise().norm();
  if (!(scale.minCoeff() > 0.0)) return std::nullopt;
  for (int c = 0; c < 3; ++c) x.col(c) /= scale[c];
  const Eigen::Matrix3d inverse = (x.transpose() * x).ldlt().solve(Eigen::Matrix3d::Identity());
  const Eigen::Vector3d of_columns = inverse * (x.transpose() * y);
  const double variance = (y - x * of_columns).squaredNorm() / std::max(1.0, independent - 3.0);
  const Eigen::Vector3d found = of_columns.cwiseQuotient(scale);
  const Eigen::Vector3d std = (variance * inverse.diagonal()).cwiseAbs().cwiseSqrt().cwiseQuotient(scale);
  if (!found.allFinite() || !std.allFinite()) return std::nullopt;
  Relation relation{found[0], found[1]};
  if (std::abs(relation.gain - 1.0) > kMostGainError + 3.0 * std[0]) return std::nullopt;
  if (std[0] > kMostGainError / 3.0) relation.gain = 1.0;
  if (std::abs(relation.lag_s) > kMostLagSamples * sample_s + 3.0 * std[1]) return std::nullopt;
  if (std[1] > kMostLagSamples * sample_s / 3.0) relation.lag_s = 0.0;
  relation.lag_s /= relation.gain;
  return relation;
}

// Variances that white noise leaves above the crossover in the derivative and in the measured velocity, and in both
// where they are weighed.
struct NoiseLeft {
  double fast_derivative = 0.0, fast_measured = 0.0, fused = 0.0;
};

NoiseLeft noise_left(double position_std, double velocity_std, double crossover_hz, double cutoff_hz, double sample_s) {
  constexpr int kSteps = 200;
  NoiseLeft left;
  for (int k = 0; k < kSteps; ++k) {
    const double frequency = (k + 0.5) / kSteps * cutoff_hz;
    const double of_position = std::pow(2.0 * std::numbers::pi * frequency * position_std, 2);
    const double weight = 1.0 / (1.0 + std::pow(frequency / crossover_hz, 2));
    left.fast_derivative += (1.0 - weight) * (1.0 - weight) * of_position;
    left.fast_measured += (1.0 - weight) * (1.0 - weight) * velocity_std * velocity_std;
    left.fused += weight * weight * of_position + (1.0 - weight) * (1.0 - weight) * velocity_std * velocity_std;
  }
  // A white noise has the density 2 std^2 sample_s.
  const double scale = 2.0 * sample_s * cutoff_hz / kSteps;
  return {scale * left.fast_derivative, scale * left.fast_measured, scale * left.fused};
}

// Whether the measured velocity has the fast motion, and lacks less of it by smoothing than the derivative has noise.
// What was smoothed has the gain g of its power, less its own noise, over its product with the derivative: g^2 to g of
// the motion's power, whatever noise the position has, white or not. Where the velocity has little but noise for that,
// the position's noise is taken for white.
bool is_better_where_fast(const std::vector<double>& derivative, const std::vector<double>& measured, std::size_t edge,
                          const NoiseLeft& left) {
  double product = 0.0, of_derivative = 0.0, of_measured = 0.0;
  for (std::size_t k = edge; k + edge < derivative.size(); ++k) {
    product += derivative[k] * measured[k];
    of_derivative += derivative[k] * derivative[k];
    of_measured += measured[k] * measured[k];
  }
  const auto rows = static_cast<double>(derivative.size() - 2 * edge);
  if (of_measured >= of_derivative) return false;
  const double noise = rows * left.fast_measured;
  if (of_measured > 3.0 * noise && product > 0.0) {
    const double gain = (of_measured - noise) / product, of_noise = 1.0 - product / gain / of_derivative;
    return gain > kLeastGain && 1.0 - gain < kLeastFastGain * of_noise;
  }
  const double motion = of_derivative - rows * left.fast_derivative;
  return motion < 2.0 * rows * left.fast_derivative || product > kLeastFastGain * motion;
}

std::vector<double> integral(std::span<const double> rate, double sample_s) {
  std::vector<double> sum(rate.size(), 0.0);
  for (std::size_t k = 1; k < rate.size(); ++k) sum[k] = sum[k - 1] + 0.5 * sample_s * (rate[k] + rate[k - 1]);
  return sum;
}

// Low-passes work on positions, whose ends have little noise: what reflects a derivative at its noisy last sample is
// off for as long as the filter remembers.
std::vector<double> slow_slope(const ZeroPhaseFilter& filter, std::span<const double> position, double sample_s) {
  return central_derivative(filter.apply(position), sample_s);
}

std::vector<double> without(const std::vector<double>& signal, std::vector<double> slow) {
  for (std::size_t k = 0; k < signal.size(); ++k) slow[k] = signal[k] - slow[k];
  return slow;
}

}  // namespace

std::optional<FusedVelocity> fused_velocity(std::span<const double> position, std::span<const double> measured,
                                            double position_std, double velocity_std, double cutoff_hz,
                                            double sample_s) {
  const std::size_t n = position.size();
  if (n != measured.size() || n < kFewest || !(position_std > 0.0)) return std::nullopt;
  const double sample_hz = 1.0 / sample_s;
  const double equal_hz = velocity_std / (2.0 * std::numbers::pi * position_std);
  const double crossover_hz = std::max(equal_hz, kPeriods / (static_cast<double>(n) * sample_s));
  if (crossover_hz > kHighestCrossover * cutoff_hz || crossover_hz >= 0.45 * sample_hz) return std::nullopt;

  const ZeroPhaseFilter calm(2, crossover_hz, sample_hz), slow(1, crossover_hz, sample_hz);
  const std::vector<double> derivative = central_derivative(position, sample_s),
                            slope = central_derivative(measured, sample_s);
  const std::vector<double> travelled = integral(measured, sample_s);
  const std::size_t edge = std::min(calm.settling_samples(), n / 8);
  const double independent = 2.0 * crossover_hz * sample_s * static_cast<double>(n - 2 * edge);
  const auto relation = relation_of(slow_slope(calm, position, sample_s), slow_slope(calm, travelled, sample_s), edge,
                                    independent, sample_s);
  if (!relation) return std::nullopt;

  std::vector<double> velocity(n);
  for (std::size_t k = 0; k < n; ++k) velocity[k] = (measured[k] + relation->lag_s * slope[k]) / relation->gain;
  const NoiseLeft left =
      noise_left(position_std, velocity_std, crossover_hz, std::min(cutoff_hz, 0.5 * sample_hz), sample_s);
  const std::vector<double> fast = without(velocity, slow_slope(slow, integral(velocity, sample_s), sample_s));
  const std::vector<double> of_position = slow_slope(slow, position, sample_s);
  if (!is_better_where_fast(without(derivative, of_position), fast, edge, left)) return std::nullopt;
  FusedVelocity fused{std::move(velocity), crossover_hz, std::sqrt(left.fused)};
  for (std::size_t k = 0; k < n; ++k) fused.velocity[k] = of_position[k] + fast[k];
  return fused;
}

}  // namespace flexspline::signals
