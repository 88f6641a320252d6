#include "host/engine/selection/bandwidth.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "host/common/signals/butterworth.hpp"
#include "host/common/signals/differentiate.hpp"

namespace flexspline::selection {
namespace {

using data::Column;
using data::Experiment;

// Squares of one bandwidth over all records: a first fit of effort by inertia, viscous and Coulomb friction and an
// offset of each record.
struct FirstFit {
  double acceleration_variance = 0.0;
  double acceleration_noise = 0.0;  // variance
  double inertia_squared = 0.0;
  double residual_variance = 0.0;
};

struct Signals {
  std::vector<double> position, effort;
  double noise = 0.0;  // of the position
};

const std::vector<double>& effort_of(const Experiment& e) {
  return e[e.has(Column::current) ? Column::current : Column::motor_torque];
}

// Variance of the second derivative of white noise below a bandwidth: its density times the integral of (2 pi f)^4.
double second_derivative_variance(double noise, double sample_s, double bandwidth_hz) {
  return 2.0 * noise * noise * sample_s * std::pow(2.0 * std::numbers::pi, 4) * std::pow(bandwidth_hz, 5) / 5.0;
}

FirstFit first_fit(const std::vector<const Experiment*>& experiments, const std::vector<double>& noise,
                   double bandwidth_hz) {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  double squares = 0.0, samples = 0.0;
  FirstFit fit;
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const Experiment& e = *experiments[i];
    const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder, bandwidth_hz, 1.0 / e.sample_s);
    const bool from_position = e.has(Column::motor_position);
    for (const data::Segment& s : e.segments) {
      const std::size_t n = s.last - s.first;
      if (n < 16) continue;
      const auto cut = [&](const std::vector<double>& whole) {
        return filter.apply(std::span<const double>(whole.data() + s.first, n));
      };
      std::vector<double> velocity = cut(from_position ? e[Column::motor_position] : e[Column::motor_velocity]);
      if (from_position) velocity = signals::central_derivative(velocity, e.sample_s);
      const std::vector<double> acceleration = signals::central_derivative(velocity, e.sample_s);
      const std::vector<double> effort = cut(effort_of(e));
      double top = 0.0;
      for (const double v : velocity) top = std::max(top, std::abs(v));
      Eigen::MatrixXd rows(static_cast<Eigen::Index>(n), 4);
      for (std::size_t k = 0; k < n; ++k)
        rows.row(static_cast<Eigen::Index>(k)) << acceleration[k], velocity[k],
            std::tanh(velocity[k] / (0.02 * top + 1e-300)), effort[k];
      rows.rowwise() -= rows.colwise().mean();
      products += rows.leftCols<3>().transpose() * rows.leftCols<3>();
      along += rows.leftCols<3>().transpose() * rows.col(3);
      squares += rows.col(3).squaredNorm();
      samples += static_cast<double>(n);
      fit.acceleration_variance += rows.col(0).squaredNorm();
      fit.acceleration_noise += static_cast<double>(n) * second_derivative_variance(noise[i], e.sample_s, bandwidth_hz);
    }
  }
  if (samples == 0.0) return fit;
  const Eigen::Vector3d size = products.diagonal().cwiseSqrt().array().max(1e-300);
  Eigen::Matrix3d scaled = size.cwiseInverse().asDiagonal() * products * size.cwiseInverse().asDiagonal();
  scaled.diagonal().array() += 1e-9;
  const Eigen::Vector3d theta = size.cwiseInverse().cwiseProduct(scaled.llt().solve(along.cwiseQuotient(size)));
  fit.inertia_squared = theta[0] * theta[0];
  fit.residual_variance = std::max(squares - along.dot(theta), 0.0) / samples;
  fit.acceleration_variance /= samples;
  fit.acceleration_noise /= samples;
  return fit;
}

}  // namespace

double noise_by_fourth_differences(const std::vector<double>& position, const std::vector<data::Segment>& segments) {
  double squares = 0.0, count = 0.0;
  for (const data::Segment& s : segments)
    for (std::size_t k = s.first + 4; k < s.last; ++k) {
      const double d =
          position[k] - 4.0 * position[k - 1] + 6.0 * position[k - 2] - 4.0 * position[k - 3] + position[k - 4];
      squares += d * d;
      count += 1.0;
    }
  return count > 0.0 ? std::sqrt(squares / (70.0 * count)) : 0.0;
}

Bandwidth highest_bandwidth(const std::vector<const Experiment*>& experiments, const SelectionPolicy& policy) {
  std::vector<const Experiment*> moving;
  std::vector<double> noise;
  double slowest_hz = 1e300;
  for (const Experiment* e : experiments) {
    slowest_hz = std::min(slowest_hz, 1.0 / e->sample_s);
    const bool position = e->has(Column::motor_position);
    if (!(e->has(Column::current) || e->has(Column::motor_torque)) || !(position || e->has(Column::motor_velocity)))
      continue;
    moving.push_back(e);
    // The filters of a measured velocity are not known, so it sets no limit here.
    noise.push_back(position ? noise_by_fourth_differences((*e)[Column::motor_position], e->segments) : 0.0);
  }
  Bandwidth result;
  const double top = std::min(policy.highest_hz, slowest_hz / 8.0);
  result.highest_hz = top;
  constexpr int kTried = 12;
  for (int k = 0; k < kTried && !moving.empty(); ++k) {
    result.highest_hz = top * std::pow(policy.bandwidth_factor, k);
    const FirstFit fit = first_fit(moving, noise, result.highest_hz);
    const double signal = fit.acceleration_variance - fit.acceleration_noise;
    if (fit.acceleration_noise <= policy.acceleration_noise_share * signal) break;
    if (fit.inertia_squared * fit.acceleration_noise <= policy.regressor_noise_share * fit.residual_variance) break;
  }
  result.reason = result.highest_hz < top   ? "limited by the noise of the positions, differentiated twice"
                  : top < policy.highest_hz ? "an eighth of the sample rate"
                                            : "the highest that is used";
  return result;
}

}  // namespace flexspline::selection
