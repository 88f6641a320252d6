#include "host/signals/fused_velocity.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/signals/butterworth.hpp"
#include "host/signals/differentiate.hpp"

namespace flexspline::signals {
namespace {

// A crossover that the signal is long enough for.
constexpr double kPeriods = 4.0;
// Above so much of the cut-off little is left to be gained.
constexpr double kHighestCrossover = 0.5;
constexpr double kMostGainError = 0.05;
constexpr double kMostLagSamples = 2.0;
// A velocity that was smoothed has less of the fast motion than the position shows.
constexpr double kLeastFastGain = 0.8;
constexpr std::size_t kFewest = 64;

struct Relation {
  double gain = 1.0, lag_s = 0.0;
};

// Of the measured velocity to the derivative where both have little noise.
std::optional<Relation> relation_of(const std::vector<double>& derivative, const std::vector<double>& measured,
                                    std::size_t edge, double sample_s) {
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
  const Eigen::ColPivHouseholderQR<Eigen::MatrixX3d> qr(x);
  if (qr.rank() < 3) return std::nullopt;
  const Eigen::Vector3d found = qr.solve(y).cwiseQuotient(scale);
  return Relation{found[0], found[1] / found[0]};
}

// Variance that white noise of the position leaves in the derivative above the crossover, times its own weight there;
// and that of both where they are weighed.
struct NoiseLeft {
  double fast_derivative = 0.0, fused = 0.0;
};

NoiseLeft noise_left(double position_std, double velocity_std, double crossover_hz, double cutoff_hz, double sample_s) {
  constexpr int kSteps = 200;
  NoiseLeft left;
  for (int k = 0; k < kSteps; ++k) {
    const double frequency = (k + 0.5) / kSteps * cutoff_hz;
    const double of_position = std::pow(2.0 * std::numbers::pi * frequency * position_std, 2);
    const double weight = 1.0 / (1.0 + std::pow(frequency / crossover_hz, 2));
    left.fast_derivative += (1.0 - weight) * (1.0 - weight) * of_position;
    left.fused += weight * weight * of_position + (1.0 - weight) * (1.0 - weight) * velocity_std * velocity_std;
  }
  // A white noise has the density 2 std^2 sample_s.
  const double scale = 2.0 * sample_s * cutoff_hz / kSteps;
  return {scale * left.fast_derivative, scale * left.fused};
}

// Whether what is fast in the derivative, and no noise of the position, is there in the measured velocity, too.
bool has_fast_motion(const std::vector<double>& derivative, const std::vector<double>& measured, std::size_t edge,
                     double noise_variance) {
  double product = 0.0, square = 0.0;
  for (std::size_t k = edge; k + edge < derivative.size(); ++k) {
    product += derivative[k] * measured[k];
    square += derivative[k] * derivative[k];
  }
  const double noise = noise_variance * static_cast<double>(derivative.size() - 2 * edge);
  const double motion = square - noise;
  return motion < 2.0 * noise || product > kLeastFastGain * motion;
}

std::vector<double> without(const std::vector<double>& signal, std::vector<double> slow) {
  for (std::size_t k = 0; k < signal.size(); ++k) slow[k] = signal[k] - slow[k];
  return slow;
}

}  // namespace

std::optional<FusedVelocity> fused_velocity(std::span<const double> derivative, std::span<const double> measured,
                                            double position_std, double velocity_std, double cutoff_hz,
                                            double sample_s) {
  const std::size_t n = derivative.size();
  if (n != measured.size() || n < kFewest || !(position_std > 0.0)) return std::nullopt;
  const double sample_hz = 1.0 / sample_s;
  const double equal_hz = velocity_std / (2.0 * std::numbers::pi * position_std);
  const double crossover_hz = std::max(equal_hz, kPeriods / (static_cast<double>(n) * sample_s));
  if (crossover_hz > kHighestCrossover * cutoff_hz || crossover_hz >= 0.45 * sample_hz) return std::nullopt;

  const ZeroPhaseFilter calm(2, crossover_hz, sample_hz);
  const std::size_t edge = std::min(calm.settling_samples(), n / 8);
  const auto relation = relation_of(calm.apply(derivative), calm.apply(measured), edge, sample_s);
  if (!relation || std::abs(relation->gain - 1.0) > kMostGainError ||
      std::abs(relation->lag_s) > kMostLagSamples * sample_s)
    return std::nullopt;

  const std::vector<double> slope = central_derivative(measured, sample_s);
  const std::vector<double> by_position(derivative.begin(), derivative.end());
  FusedVelocity fused;
  fused.velocity.resize(n);
  for (std::size_t k = 0; k < n; ++k) fused.velocity[k] = (measured[k] + relation->lag_s * slope[k]) / relation->gain;
  const NoiseLeft left =
      noise_left(position_std, velocity_std, crossover_hz, std::min(cutoff_hz, 0.5 * sample_hz), sample_s);
  const ZeroPhaseFilter slow(1, crossover_hz, sample_hz);
  const std::vector<double> fast_measured = without(fused.velocity, slow.apply(fused.velocity));
  std::vector<double> slow_derivative = slow.apply(by_position);
  if (!has_fast_motion(without(by_position, slow_derivative), fast_measured, edge, left.fast_derivative))
    return std::nullopt;
  for (std::size_t k = 0; k < n; ++k) fused.velocity[k] = slow_derivative[k] + fast_measured[k];
  fused.crossover_hz = crossover_hz;
  fused.std = std::sqrt(left.fused);
  return fused;
}

}  // namespace flexspline::signals
