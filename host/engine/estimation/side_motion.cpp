#include "host/engine/estimation/side_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "host/common/signals/differentiate.hpp"
#include "host/common/signals/fused_velocity.hpp"
#include "host/common/signals/kalman_smoother.hpp"
#include "host/common/signals/quantum.hpp"

namespace flexspline::estimation {

using data::Column;
using data::Experiment;
using data::Segment;
using signals::ZeroPhaseFilter;

std::vector<double> filtered(const std::vector<double>& signal, const std::vector<Segment>& segments,
                             const ZeroPhaseFilter& filter) {
  std::vector<double> result = signal;
  for (const Segment& s : segments) filter.apply_in_place(std::span<double>(result.data() + s.first, s.last - s.first));
  return result;
}

std::vector<double> slope_of(const std::vector<double>& signal, const std::vector<Segment>& segments, double sample_s) {
  std::vector<double> result(signal.size(), 0.0);
  for (const Segment& s : segments)
    signals::central_derivative(std::span<const double>(signal.data() + s.first, s.last - s.first), sample_s,
                                std::span<double>(result.data() + s.first, s.last - s.first));
  return result;
}

namespace {

// Noise of the derivative over the white noise of the signal, after the filter.
double derivative_noise_gain(const ZeroPhaseFilter& filter, double sample_s) {
  const std::size_t half = 4 * filter.settling_samples() + 8;
  std::vector<double> impulse(2 * half + 1, 0.0);
  impulse[half] = 1.0;
  filter.apply_in_place(impulse);
  const std::vector<double> slope = signals::central_derivative(impulse, sample_s);
  return std::sqrt(std::inner_product(slope.begin(), slope.end(), slope.begin(), 0.0));
}

// Root mean square of what a filter has taken away.
double root_mean_square_of_rest(const std::vector<double>& raw, const std::vector<double>& kept) {
  if (raw.empty()) return 0.0;
  double sum = 0.0;
  for (std::size_t k = 0; k < raw.size(); ++k) sum += (raw[k] - kept[k]) * (raw[k] - kept[k]);
  return std::sqrt(sum / static_cast<double>(raw.size()));
}

SideMotion motion_from_position(const std::vector<double>& raw, const std::vector<Segment>& segments,
                                const ZeroPhaseFilter& filter, double sample_s) {
  SideMotion m;
  m.position = filtered(raw, segments, filter);
  m.velocity = slope_of(m.position, segments, sample_s);
  // The filter keeps a share of the noise; what it removes is an estimate of the rest.
  const double kept = std::min(0.8, 2.0 * filter.cutoff_hz() * sample_s);
  m.position_noise = root_mean_square_of_rest(raw, m.position) / std::sqrt(1.0 - kept);
  return m;
}

SideMotion motion_from_velocity(const std::vector<double>& raw, const std::vector<Segment>& segments,
                                const ZeroPhaseFilter& filter, double sample_s) {
  SideMotion m;
  m.velocity = filtered(raw, segments, filter);
  m.position.resize(raw.size(), 0.0);
  for (const Segment& s : segments)
    for (std::size_t k = s.first + 1; k < s.last; ++k)
      m.position[k] = m.position[k - 1] + 0.5 * sample_s * (m.velocity[k] + m.velocity[k - 1]);
  return m;
}

// White noise of a measured signal, by what the filter removes: the filter keeps a share.
double noise_of(const std::vector<double>& raw, const std::vector<double>& kept, const ZeroPhaseFilter& filter,
                double sample_s) {
  return root_mean_square_of_rest(raw, kept) / std::sqrt(1.0 - std::min(0.8, 2.0 * filter.cutoff_hz() * sample_s));
}

// Whether the noise of the position is a relevant share of the acceleration: noise of a regressor attenuates its
// coefficient (the inertia) by that share.
bool blurs_accelerations(const SideMotion& motion, const std::vector<Segment>& segments, double cutoff_hz,
                         double sample_s) {
  constexpr double kShare = 0.005;
  const std::vector<double> acceleration = slope_of(motion.velocity, segments, sample_s);
  const double square = std::inner_product(acceleration.begin(), acceleration.end(), acceleration.begin(), 0.0);
  // White noise, differentiated twice below the cut-off.
  const double noise = std::pow(2.0 * M_PI, 4) * 2.0 * sample_s * motion.position_noise * motion.position_noise *
                       std::pow(cutoff_hz, 5) / 5.0;
  return noise * static_cast<double>(acceleration.size()) > kShare * square;
}

// Combines a velocity that was measured in addition to the position with the derivative where it has less noise than
// that; returns from which frequency on, and in `noise` what is left of both. Zero: it does not help.
double take_measured_velocity(SideMotion& motion, const std::vector<double>& measured,
                              const std::vector<Segment>& segments, const ZeroPhaseFilter& filter, double sample_s,
                              double& noise) {
  if (!blurs_accelerations(motion, segments, filter.cutoff_hz(), sample_s)) return 0.0;
  const std::vector<double> kept = filtered(measured, segments, filter);
  const double measured_noise = noise_of(measured, kept, filter, sample_s);
  double crossover_hz = 0.0, least = noise;
  for (const Segment& s : segments) {
    const auto part = [&](const std::vector<double>& signal) {
      return std::span<const double>(signal.data() + s.first, s.last - s.first);
    };
    const auto fused = signals::fused_velocity(part(motion.position), part(kept), motion.position_noise, measured_noise,
                                               filter.cutoff_hz(), sample_s);
    if (!fused || !(fused->std < noise)) continue;
    std::copy(fused->velocity.begin(), fused->velocity.end(),
              motion.velocity.begin() + static_cast<std::ptrdiff_t>(s.first));
    crossover_hz = std::max(crossover_hz, fused->crossover_hz);
    least = std::min(least, fused->std);
  }
  noise = least;
  return crossover_hz;
}

// Covariances are those of the longest segment, and hold for all. Nothing where the numbers are too large for any.
std::optional<SideMotion> smoothed_side(const std::vector<double>& position, std::optional<double> quantum,
                                        const Experiment& e) {
  const auto part = [&](const Segment& s) {
    return std::span<const double>(position.data() + s.first, s.last - s.first);
  };
  const Segment& longest = *std::ranges::max_element(e.segments, {}, [](const Segment& s) { return s.last - s.first; });
  const signals::MotionCovariances covariances =
      signals::most_likely_covariances(part(longest), e.sample_s, std::pow(quantum.value_or(0.0), 2) / 12.0);
  if (!std::isfinite(covariances.position_variance) || !std::isfinite(covariances.jerk_density)) return std::nullopt;
  SideMotion side;
  for (std::vector<double>* signal : {&side.position, &side.velocity, &side.acceleration})
    signal->resize(position.size(), 0.0);
  for (const Segment& s : e.segments) {
    const signals::SmoothedMotion motion = signals::rauch_tung_striebel(part(s), e.sample_s, covariances);
    const auto first = static_cast<std::ptrdiff_t>(s.first);
    std::ranges::copy(motion.position, side.position.begin() + first);
    std::ranges::copy(motion.velocity, side.velocity.begin() + first);
    std::ranges::copy(motion.acceleration, side.acceleration.begin() + first);
    side.velocity_noise = motion.velocity_std;
  }
  side.position_noise = std::sqrt(covariances.position_variance);
  side.smoother_corner_hz = covariances.corner_hz(e.sample_s);
  side.quantum = quantum;
  side.measured = true;
  return side;
}

// The smoother takes three samples, and its covariances sixteen.
bool is_long_enough(const std::vector<Segment>& segments) {
  std::size_t longest = 0, shortest = SIZE_MAX;
  for (const Segment& s : segments) {
    longest = std::max(longest, s.last - s.first);
    shortest = std::min(shortest, s.last - s.first);
  }
  return longest >= 16 && shortest >= 3;
}

// `velocity` is the column that may have been measured as well.
SideMotion side_from_position(const std::vector<double>& position, Column velocity, std::optional<double> quantum,
                              const Experiment& e, const ZeroPhaseFilter& filter, Derivatives derivatives) {
  if (derivatives == Derivatives::kalman && is_long_enough(e.segments))
    if (auto smoothed = smoothed_side(position, quantum, e)) return std::move(*smoothed);
  SideMotion side = motion_from_position(position, e.segments, filter, e.sample_s);
  side.quantum = quantum;
  side.position_noise = std::max(side.position_noise, quantum.value_or(0.0) / std::sqrt(12.0));
  side.velocity_noise = side.position_noise * derivative_noise_gain(filter, e.sample_s);
  side.measured = true;
  if (e.has(velocity))
    side.velocity_crossover_hz =
        take_measured_velocity(side, e[velocity], e.segments, filter, e.sample_s, side.velocity_noise);
  return side;
}

}  // namespace

SideMotion motor_side(const Experiment& e, const catalogue::DriveConstants<double>& drive,
                      const ZeroPhaseFilter& filter, Derivatives derivatives) {
  if (e.has(Column::motor_position)) {
    const std::vector<double>& position = e[Column::motor_position];
    const std::optional<double> quantum = e.encoder_counts && drive.turn_angle_scale == 1.0
                                              ? std::optional(2.0 * M_PI / *e.encoder_counts)
                                              : signals::quantum_of(position);
    return side_from_position(position, Column::motor_velocity, quantum, e, filter, derivatives);
  }
  if (!e.has(Column::motor_velocity)) return {};
  SideMotion side = motion_from_velocity(e[Column::motor_velocity], e.segments, filter, e.sample_s);
  const double kept = std::min(0.8, 2.0 * filter.cutoff_hz() * e.sample_s);
  side.velocity_noise =
      root_mean_square_of_rest(e[Column::motor_velocity], side.velocity) * std::sqrt(kept / (1.0 - kept));
  side.measured = true;
  return side;
}

SideMotion output_side(const Experiment& e, const ZeroPhaseFilter& filter, Derivatives derivatives) {
  if (e.has(Column::output_position)) {
    const std::vector<double>& position = e[Column::output_position];
    const std::optional<double> quantum =
        e.output_encoder_counts ? std::optional(2.0 * M_PI / *e.output_encoder_counts) : signals::quantum_of(position);
    return side_from_position(position, Column::output_velocity, quantum, e, filter, derivatives);
  }
  if (!e.has(Column::output_velocity)) return {};
  SideMotion side = motion_from_velocity(e[Column::output_velocity], e.segments, filter, e.sample_s);
  side.measured = true;
  return side;
}

}  // namespace flexspline::estimation
