#include "host/engine/measurement/derivatives.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <span>

#include "host/common/signals/butterworth.hpp"
#include "host/common/signals/cutoff.hpp"
#include "host/common/signals/differentiate.hpp"
#include "host/common/signals/differentiators.hpp"

namespace flexspline::measurement {
namespace {

using data::Column;
using data::Experiment;
using Samples = std::span<const double>;

constexpr double kMotionOverBand = 2.5;       // as positions are filtered for the identification
constexpr double kHighestCutoffShare = 0.45;  // of the sample rate
constexpr std::size_t kFewestSamples = 64;

// The reference: its velocity and acceleration.
struct Reference {
  std::vector<double> velocity, acceleration;
};

double root_mean_square(Samples x, std::size_t edge) {
  double sum = 0.0;
  for (std::size_t k = edge; k + edge < x.size(); ++k) sum += x[k] * x[k];
  return std::sqrt(sum / static_cast<double>(x.size() - 2 * edge));
}

std::optional<double> rms_difference(const std::vector<double>& x, const std::vector<double>& from, std::size_t edge) {
  if (x.size() != from.size()) return std::nullopt;
  std::vector<double> left(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) left[k] = x[k] - from[k];
  const double rms = root_mean_square(left, edge);
  return std::isfinite(rms) ? std::optional(rms) : std::nullopt;
}

// v(t) = gain * reference(t - lag), to first order in the lag.
std::optional<double> lag(const std::vector<double>& velocity, const Reference& reference, std::size_t edge) {
  Eigen::Matrix2d products = Eigen::Matrix2d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::Zero();
  for (std::size_t k = edge; k + edge < velocity.size(); ++k) {
    const Eigen::Vector2d columns(reference.velocity[k], -reference.acceleration[k]);
    products += columns * columns.transpose();
    along += columns * velocity[k];
  }
  const Eigen::Vector2d found = products.ldlt().solve(along);
  if (!found.allFinite() || !(std::abs(found[0]) > 0.1)) return std::nullopt;
  return found[1] / found[0];
}

double cutoff_of(const Experiment& e, Samples position, const data::Segment& s, const DerivativeOptions& options) {
  const double sample_hz = 1.0 / e.sample_s;
  if (options.cutoff_hz) {
    if (*options.cutoff_hz < kHighestCutoffShare * sample_hz) return *options.cutoff_hz;
    throw data::DataError(
        {{data::Severity::error, "cutoff", "", 0, "",
          fmt::format("a cut-off of {} Hz does not fit data sampled at {:.6g} Hz", *options.cutoff_hz, sample_hz),
          fmt::format("give --cutoff-hz below {:.4g}", kHighestCutoffShare * sample_hz)}});
  }
  const Column effort = e.has(Column::current) ? Column::current : Column::motor_torque;
  if (!e.has(effort)) return sample_hz / 10.0;
  const std::vector<double> slope = signals::central_derivative(position, e.sample_s);
  const Samples measured(e[effort].data() + s.first, s.last - s.first);
  const double band_hz = signals::choose_cutoff(measured, slope, sample_hz).cutoff_hz;
  return std::min(kMotionOverBand * band_hz, kHighestCutoffShare * sample_hz);
}

DerivativeMethod smoothed(Samples position, const DerivativeComparison& c, double position_std) {
  const signals::SmootherNoise gain = signals::smoother_noise(c.sample_s, c.covariances);
  signals::SmoothedMotion motion = signals::rauch_tung_striebel(position, c.sample_s, c.covariances);
  DerivativeMethod m;
  m.name = "kalman-rts";
  m.explanation = "Kalman filter forward and Rauch-Tung-Striebel correction backward; no delay";
  m.velocity_noise = position_std * gain.velocity;
  m.acceleration_noise = position_std * gain.acceleration;
  m.velocity = std::move(motion.velocity);
  m.acceleration = std::move(motion.acceleration);
  return m;
}

DerivativeMethod differentiated(const signals::DifferentiatorInfo& info, Samples position,
                                const DerivativeComparison& c, double position_std) {
  const signals::DifferentiatingFilter filter(info.which, c.cutoff_hz, c.sample_s);
  signals::Derivatives found = filter.apply(position);
  const auto noise = [&](int order) -> std::optional<double> {
    const double gain = filter.noise_gain(order);
    return std::isfinite(gain) ? std::optional(position_std * gain) : std::nullopt;
  };
  DerivativeMethod m;
  m.name = info.which == signals::Differentiator::butterworth ? "butterworth-zero-phase" : std::string(info.name);
  m.explanation = info.explanation;
  m.velocity_noise = noise(1);
  if (info.gives_acceleration) m.acceleration_noise = noise(2);
  m.velocity = std::move(found.velocity);
  if (info.gives_acceleration) m.acceleration = std::move(found.acceleration);
  return m;
}

DerivativeComparison compared(const Experiment& e, Column column, Column velocity, std::optional<double> step,
                              const DerivativeOptions& options) {
  const data::Segment& s =
      *std::ranges::max_element(e.segments, {}, [](const data::Segment& one) { return one.last - one.first; });
  const auto part = [&](const std::vector<double>& signal) {
    return Samples(signal.data() + s.first, s.last - s.first);
  };
  const Samples position = part(e[column]);
  DerivativeComparison c;
  c.experiment = e.name;
  c.column = data::column_name(column);
  c.sample_s = e.sample_s;
  c.cutoff_hz = cutoff_of(e, position, s, options);
  c.time_s.assign(part(e.time_s).begin(), part(e.time_s).end());
  c.step = step;
  c.covariances = signals::most_likely_covariances(position, e.sample_s, std::pow(step.value_or(0.0), 2) / 12.0);
  if (!std::isfinite(c.covariances.position_variance) || !std::isfinite(c.covariances.jerk_density))
    throw data::DataError({{data::Severity::error, "unit", e.file.string(), 0, std::string(c.column),
                            "its numbers are too large to be differentiated", "state its unit in dataset.toml"}});
  c.corner_hz = c.covariances.corner_hz(e.sample_s);
  const double position_std = std::sqrt(c.covariances.position_variance);
  c.methods.push_back(smoothed(position, c, position_std));
  const auto all = signals::differentiators();
  for (auto info = all.rbegin(); info != all.rend(); ++info)  // the zero-phase filter is the last of them
    c.methods.push_back(differentiated(*info, position, c, position_std));

  Reference reference{c.methods.front().velocity, c.methods.front().acceleration};
  c.reference = "kalman-rts";
  const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder, c.cutoff_hz, 1.0 / e.sample_s);
  if (e.has(velocity)) {
    reference.velocity = filter.apply(part(e[velocity]));
    reference.acceleration = signals::central_derivative(reference.velocity, e.sample_s);
    c.reference = data::column_name(velocity);
  }
  const std::size_t edge = std::min(filter.settling_samples(), position.size() / 10);
  c.velocity_rms = root_mean_square(reference.velocity, edge);
  c.acceleration_rms = root_mean_square(reference.acceleration, edge);
  for (DerivativeMethod& m : c.methods) {
    m.velocity_difference = rms_difference(m.velocity, reference.velocity, edge);
    m.acceleration_difference = rms_difference(m.acceleration, reference.acceleration, edge);
    m.lag_s = lag(m.velocity, reference, edge);
  }
  return c;
}

}  // namespace

std::vector<DerivativeComparison> compare_derivatives(const data::Dataset& dataset, const DerivativeOptions& options) {
  std::vector<DerivativeComparison> all;
  for (const Experiment& e : dataset.experiments) {
    const auto take = [&](bool wanted, Column column, Column velocity, const std::optional<double>& counts) {
      if (!wanted || !e.has(column)) return;
      std::size_t longest = 0;
      for (const data::Segment& s : e.segments) longest = std::max(longest, s.last - s.first);
      if (longest < kFewestSamples) return;
      std::optional<double> step = data::encoder_step(counts, dataset.drive.axis.value_or(data::Axis::rotary));
      if (!step) step = data::step_of(e, column);
      all.push_back(compared(e, column, velocity, step, options));
    };
    take(options.motor, Column::motor_position, Column::motor_velocity, e.encoder_counts);
    take(options.output && e.load != data::Load::locked, Column::output_position, Column::output_velocity,
         e.output_encoder_counts);
  }
  if (all.empty())
    throw data::DataError(
        {{data::Severity::error, "missing_column", "", 0, "",
          fmt::format("no experiment has a position of that side over {} samples without a gap", kFewestSamples),
          "record motor_position_rad or output_position_rad, or map them in dataset.toml"}});
  return all;
}

}  // namespace flexspline::measurement
