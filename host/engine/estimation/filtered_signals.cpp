#include "host/engine/estimation/filtered_signals.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>

#include "host/common/signals/differentiate.hpp"
#include "host/common/signals/fused_velocity.hpp"
#include "host/common/signals/kalman_smoother.hpp"

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

// Samples per second after decimation, over the cut-off: twice the Nyquist rate of what the filter lets through.
constexpr double kRowsOverCutoff = 4.0;

// Position and velocity of one side of the gear.
struct SideMotion {
  std::vector<double> position, velocity;
  std::vector<double> acceleration;  // empty: the slope of the velocity
  double smoother_corner_hz = 0.0;   // of the Kalman smoother; zero: there is none
  double position_noise = 0.0;       // white, before the filter
  double velocity_noise = 0.0;       // after the filter
  std::optional<double> quantum;     // smallest step of the position
  bool measured = false;
  double velocity_crossover_hz = 0.0;  // from here on the velocity is the measured one; zero: the derivative alone
};

// Where an experiment has it.
struct SideColumns {
  Column position, velocity;
  std::optional<double> step;  // of the encoder, where it is stated
};

// The share of white noise that a filter keeps.
double kept_share(const ZeroPhaseFilter& filter, double sample_s) {
  return std::min(0.8, 2.0 * filter.cutoff_hz() * sample_s);
}

// Noise of the derivative over the white noise of the signal, after the filter.
double derivative_noise_gain(const ZeroPhaseFilter& filter, double sample_s) {
  const std::size_t half = 4 * filter.settling_samples() + 8;
  std::vector<double> impulse(2 * half + 1, 0.0);
  impulse[half] = 1.0;
  const std::vector<Segment> whole = {{0, impulse.size()}};
  const std::vector<double> slope = slope_of(filtered(impulse, whole, filter), whole, sample_s);
  return std::sqrt(std::inner_product(slope.begin(), slope.end(), slope.begin(), 0.0));
}

// Root mean square of what a filter has taken away.
double root_mean_square_of_rest(const std::vector<double>& raw, const std::vector<double>& kept) {
  if (raw.empty()) return 0.0;
  double sum = 0.0;
  for (std::size_t k = 0; k < raw.size(); ++k) sum += (raw[k] - kept[k]) * (raw[k] - kept[k]);
  return std::sqrt(sum / static_cast<double>(raw.size()));
}

// White noise of a measured signal: the filter keeps a share, and what it removes is an estimate of the rest.
double white_noise_of(const std::vector<double>& raw, const std::vector<double>& kept, const ZeroPhaseFilter& filter,
                      double sample_s) {
  return root_mean_square_of_rest(raw, kept) / std::sqrt(1.0 - kept_share(filter, sample_s));
}

SideMotion motion_from_position(const std::vector<double>& raw, const std::vector<Segment>& segments,
                                const ZeroPhaseFilter& filter, double sample_s) {
  SideMotion m;
  m.position = filtered(raw, segments, filter);
  m.velocity = slope_of(m.position, segments, sample_s);
  m.position_noise = white_noise_of(raw, m.position, filter, sample_s);
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
  const double measured_noise = white_noise_of(measured, kept, filter, sample_s);
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

SideMotion side_from_position(const Experiment& e, const SideColumns& columns, const ZeroPhaseFilter& filter,
                              Derivatives derivatives) {
  const std::vector<double>& position = e[columns.position];
  const std::optional<double> quantum = columns.step ? columns.step : data::step_of(e, columns.position);
  if (derivatives == Derivatives::kalman && is_long_enough(e.segments))
    if (auto smoothed = smoothed_side(position, quantum, e)) return std::move(*smoothed);
  SideMotion side = motion_from_position(position, e.segments, filter, e.sample_s);
  side.quantum = quantum;
  side.position_noise = std::max(side.position_noise, quantum.value_or(0.0) / std::sqrt(12.0));
  side.velocity_noise = side.position_noise * derivative_noise_gain(filter, e.sample_s);
  if (e.has(columns.velocity))
    side.velocity_crossover_hz =
        take_measured_velocity(side, e[columns.velocity], e.segments, filter, e.sample_s, side.velocity_noise);
  return side;
}

// Nothing is measured where the experiment has neither position nor velocity of that side.
SideMotion side_of(const Experiment& e, const SideColumns& columns, const ZeroPhaseFilter& filter,
                   Derivatives derivatives) {
  SideMotion side;
  if (e.has(columns.position))
    side = side_from_position(e, columns, filter, derivatives);
  else if (e.has(columns.velocity))
    side = motion_from_velocity(e[columns.velocity], e.segments, filter, e.sample_s);
  side.measured = e.has(columns.position) || e.has(columns.velocity);
  return side;
}

// A current that is held for a sample acts, on average, half a sample after its time stamp; the mean with the sample
// before puts it at the instant at which positions are read.
std::vector<double> align_held(const std::vector<double>& held, const std::vector<Segment>& segments) {
  std::vector<double> aligned = held;
  for (const Segment& s : segments)
    for (std::size_t k = s.last; k-- > s.first + 1;) aligned[k] = 0.5 * (held[k] + held[k - 1]);
  return aligned;
}

// Drive off: nothing moves, and the effort changes no more than noise does. A stuck axis under a changing effort is
// none: its friction is unknown. Noise may be correlated over some samples (of the first order, by its correlation of
// neighbours); its means over eighths of the record then scatter no more than three times as they should.
bool is_at_rest(const Record& record, double motion_span, double resolution) {
  constexpr double kMostCorrelated = 0.97, kMostScatter = 3.0;
  constexpr std::size_t kParts = 8;
  const std::size_t n = record.effort.size();
  if (record.locked || n < 2 * kParts || motion_span > 2.0 * resolution) return false;
  const auto mean_of = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    for (std::size_t k = from; k < to; ++k) sum += record.effort[k];
    return sum / static_cast<double>(to - from);
  };
  const double mean = mean_of(0, n);
  double steps = 0.0, spread_squared = 0.0;
  for (std::size_t k = 1; k < n; ++k) {
    steps += (record.effort[k] - record.effort[k - 1]) * (record.effort[k] - record.effort[k - 1]);
    spread_squared += (record.effort[k] - mean) * (record.effort[k] - mean);
  }
  const double rounding = 1e-12 * mean * mean * static_cast<double>(n);
  // Neighbours of white noise differ by sqrt(2) times its deviation; of noise averaged over two samples by once (von
  // Neumann 1941).
  if (spread_squared <= 2.0 * steps + rounding) return true;
  const double correlation = 1.0 - 0.5 * steps / spread_squared;
  if (correlation > kMostCorrelated) return false;
  double between = 0.0;
  for (std::size_t p = 0; p < kParts; ++p) {
    const double off = mean_of(n * p / kParts, n * (p + 1) / kParts) - mean;
    between += off * off / static_cast<double>(kParts - 1);
  }
  const double variance = spread_squared / static_cast<double>(n);
  const double as_one = (1.0 + correlation) / (1.0 - correlation);
  return between <= kMostScatter * variance * as_one * static_cast<double>(kParts) / static_cast<double>(n);
}

// Torques, temperature and effort.
void take_torques(Record& r, const Experiment& e, const catalogue::DriveConstants<double>& drive,
                  const ZeroPhaseFilter& filter) {
  if (e.has(Column::torque)) {
    r.torque = e[Column::torque];
    r.inputs.torque = filtered(r.torque, r.segments, filter);
  }
  if (e.has(Column::load_torque)) {
    r.load_torque = e[Column::load_torque];
    // Without a sensor it is what is known of the torque through the gear.
    if (!e.has(Column::torque)) r.inputs.torque = filtered(r.load_torque, r.segments, filter);
  }
  if (e.has(Column::temperature)) {
    // Housings warm up over minutes: all that is faster is noise.
    const double sample_hz = 1.0 / e.sample_s;
    const ZeroPhaseFilter slow(2, std::min(0.5, 0.4 * sample_hz), sample_hz);
    r.inputs.temperature = filtered(e[Column::temperature], r.segments, slow);
    r.has_temperature = true;
  }
  const auto aligned = [&](const std::vector<double>& measured) {
    return e.current_hold == data::CurrentHold::zoh ? ScaledSignal(align_held(measured, r.segments))
                                                    : ScaledSignal(measured);
  };
  if (e.has(Column::current)) {
    r.inputs.current = aligned(e[Column::current]);
    r.effort = r.inputs.current.times(drive.torque_constant);
  } else if (e.has(Column::motor_torque)) {
    r.effort = aligned(e[Column::motor_torque]);
  }
}

// Noise of the torsion's rate. That of both positions together, or less: an error of the time stamps, and motion faster
// than the filter, are in both positions and not in their difference.
double torsion_rate_noise(const Experiment& e, const SideMotion& motor, const SideMotion& output, double gear_ratio,
                          const ZeroPhaseFilter& filter) {
  const double of_both = std::hypot(motor.velocity_noise / gear_ratio, output.velocity_noise);
  if (!e.has(Column::motor_position) || !e.has(Column::output_position)) return of_both;
  std::vector<double> torsion = e[Column::motor_position];
  for (std::size_t k = 0; k < torsion.size(); ++k) torsion[k] = torsion[k] / gear_ratio - e[Column::output_position][k];
  const double of_steps =
      std::hypot(motor.quantum.value_or(0.0) / gear_ratio, output.quantum.value_or(0.0)) / std::sqrt(12.0);
  const double noise =
      std::max(of_steps, white_noise_of(torsion, filtered(torsion, e.segments, filter), filter, e.sample_s));
  return std::min(of_both, noise * derivative_noise_gain(filter, e.sample_s));
}

// Motion of both sides, the noise of their directions, and whether the drive is off.
void take_motion(Record& r, const Experiment& e, const PreparedData& prepared, const ZeroPhaseFilter& filter,
                 Derivatives derivatives) {
  const double gear_ratio = prepared.constants.gear_ratio;
  const auto side = [&](Column position, Column velocity, const std::optional<double>& counts) {
    return side_of(e, {position, velocity, data::encoder_step(counts, prepared.drive.axis)}, filter, derivatives);
  };
  SideMotion motor = side(Column::motor_position, Column::motor_velocity, e.encoder_counts);
  if (motor.measured && !e.has(Column::motor_position)) {
    const double kept = kept_share(filter, e.sample_s);
    motor.velocity_noise =
        root_mean_square_of_rest(e[Column::motor_velocity], motor.velocity) * std::sqrt(kept / (1.0 - kept));
  }
  SideMotion output;
  if (!r.locked) output = side(Column::output_position, Column::output_velocity, e.output_encoder_counts);
  r.has_motor_motion = motor.measured;
  r.has_output_motion = output.measured || r.locked;
  r.motor_quantum = motor.quantum;
  r.velocity_crossover_hz = motor.velocity_crossover_hz;
  r.smoother_corner_hz = motor.smoother_corner_hz;
  r.output_quantum = output.quantum;
  r.velocity_noise[index(Balance::motor)] = motor.velocity_noise;
  r.velocity_noise[index(Balance::load)] =
      r.has_output_motion && output.velocity_noise > 0.0 ? output.velocity_noise : motor.velocity_noise / gear_ratio;
  r.velocity_noise[index(Balance::transmission)] =
      r.locked ? motor.velocity_noise / gear_ratio : torsion_rate_noise(e, motor, output, gear_ratio, filter);
  if (r.has_motor_motion) {
    const std::vector<double>& p = e.has(Column::motor_position) ? e[Column::motor_position] : motor.position;
    const auto [low, high] = std::minmax_element(p.begin(), p.end());
    r.at_rest = is_at_rest(r, *high - *low, std::max(r.motor_quantum.value_or(0.0), motor.position_noise));
  }
  r.inputs.angle = std::move(motor.position);
  r.inputs.velocity = std::move(motor.velocity);
  r.inputs.acceleration = std::move(motor.acceleration);
  r.inputs.output_angle = std::move(output.position);
  r.inputs.output_velocity = std::move(output.velocity);
  r.inputs.output_acceleration = std::move(output.acceleration);
  r.inputs.at_rest = r.at_rest;
  r.inputs.velocity_noise = r.velocity_noise;
}

}  // namespace

Record with_signals(const Experiment& e, const PreparedData& prepared, const Pipeline& pipeline) {
  const catalogue::DriveConstants<double>& drive = prepared.constants;
  Record r;
  r.experiment = &e;
  r.name = e.name;
  r.locked = e.load == data::Load::locked;
  r.sample_s = e.sample_s;
  r.segments = e.segments;
  const double sample_hz = 1.0 / e.sample_s;
  r.decimation = std::max<std::size_t>(
      1, static_cast<std::size_t>(std::floor(sample_hz / (kRowsOverCutoff * pipeline.row_cutoff_hz) + 1e-9)));
  const ZeroPhaseFilter filter(ZeroPhaseFilter::kDefaultOrder, std::min(pipeline.motion_cutoff_hz, 0.45 * sample_hz),
                               sample_hz);
  r.inputs.resize(e.size());
  r.inputs.segments = e.segments;
  r.inputs.sample_s = e.sample_s;
  r.inputs.gear_ratio = drive.gear_ratio;
  r.inputs.reference_temperature = drive.reference_temperature;
  r.inputs.locked = r.locked;
  r.settling = filter.settling_samples();
  take_torques(r, e, drive, filter);
  take_motion(r, e, prepared, filter, pipeline.derivatives);
  r.inputs.keep_directions();
  return r;
}

}  // namespace flexspline::estimation
