#include "host/physics/simulation/initial_motion.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace flexspline::simulation {
namespace {

struct Slope {
  double value = 0.0;
  double std = 0.0;
};

// Slope at the first sample of a least-squares parabola; fewer than eight samples give the first difference.
Slope slope_at_start(const double* position, std::size_t count, double sample_s) {
  constexpr double kWindow = 0.02;
  const auto wanted = static_cast<std::size_t>(std::lround(kWindow / sample_s)) + 1;
  const std::size_t window = std::min(count, std::max<std::size_t>(wanted, 8));
  if (window < 2) return {};
  if (window < 8) return {(position[1] - position[0]) / sample_s, INFINITY};
  const auto rows = static_cast<Eigen::Index>(window);
  Eigen::MatrixXd powers(rows, 3);
  Eigen::VectorXd values(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const double t = static_cast<double>(k) / static_cast<double>(window);
    powers.row(k) << 1.0, t, t * t;
    values(k) = position[k] - position[0];
  }
  const double unit = sample_s * static_cast<double>(window);
  const Eigen::Vector3d fit = powers.householderQr().solve(values);
  const double variance = (values - powers * fit).squaredNorm() / static_cast<double>(rows - 3);
  const Eigen::Matrix3d normal = powers.transpose() * powers;
  // What a parabola does not follow (a change of acceleration) is as likely to change the slope as noise is; it is the
  // same from sample to sample, so it does not average out.
  return {fit(1) / unit, std::sqrt(variance * normal.inverse()(1, 1) * static_cast<double>(window) / 8.0) / unit};
}

// Noise of a signal from its second differences at the start of the record.
double scatter(const double* values, std::size_t count) {
  const std::size_t window = std::min<std::size_t>(count, 64);
  if (window < 3) return 0.0;
  double sum = 0.0;
  for (std::size_t k = 1; k + 1 < window; ++k) {
    const double second = values[k - 1] - 2.0 * values[k] + values[k + 1];
    sum += second * second;
  }
  return std::sqrt(sum / (6.0 * static_cast<double>(window - 2)));
}

}  // namespace

std::optional<InitialMotion> initial_motion(const data::Experiment& experiment, const data::Segment& segment,
                                            data::Column position, data::Column velocity) {
  const bool has_position = experiment.has(position);
  const bool has_velocity = experiment.has(velocity);
  if (!has_position && !has_velocity) return std::nullopt;
  const std::size_t count = segment.last - segment.first;
  InitialMotion motion;
  Slope slope{0.0, INFINITY};
  if (has_position) {
    const double* positions = experiment[position].data() + segment.first;
    motion.position = positions[0];
    slope = slope_at_start(positions, count, experiment.sample_s);
  }
  motion.velocity = slope.value;
  if (has_velocity) {
    const double* velocities = experiment[velocity].data() + segment.first;
    const auto& stated = experiment.noise_std[static_cast<std::size_t>(velocity)];
    if (stated.value_or(scatter(velocities, count)) <= slope.std) motion.velocity = velocities[0];
  }
  return motion;
}

}  // namespace flexspline::simulation
