#include "tests/worlds/drives/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexspline::worlds::drives {
namespace {

/// Gauss-Markov noise of first order: RMS, corner; exact from step to step (Brown and Hwang, Random Signals, ch. 5).
class ColouredNoise {
 public:
  ColouredNoise(double rms, double corner_hz, double step_s, std::uint64_t seed, const char* stream)
      : rms_(rms),
        decay_(std::exp(-2.0 * std::numbers::pi * corner_hz * step_s)),
        random_(seed, stream),
        value_(rms * random_.normal()) {}

  double next() {
    if (rms_ > 0.0) value_ = decay_ * value_ + rms_ * std::sqrt(1.0 - decay_ * decay_) * random_.normal();
    return value_;
  }

 private:
  double rms_;
  double decay_;
  Random random_;
  double value_;
};

double brake_level_nm(const Brake& brake, double share) {
  if (brake.levels_nm.empty()) return 0.0;
  if (brake.is_wave) {
    const double mean = brake.levels_nm.front();
    return mean * (1.0 + 0.8 * std::sin(2.0 * std::numbers::pi * 3.0 * share));
  }
  const auto count = brake.levels_nm.size();
  return brake.levels_nm[std::min(count - 1, static_cast<std::size_t>(share * static_cast<double>(count)))];
}

double encoder_rad(const Sensors& sensors, double motor_rad) {
  const double seen = motor_rad + sensors.eccentricity_rad * std::sin(motor_rad + sensors.eccentricity_phase_rad);
  const double count_rad = 2.0 * std::numbers::pi / sensors.motor_counts;
  return count_rad * std::floor(seen / count_rad);
}

SetPoint set_point_at(const RecordPlan& plan, std::size_t k) {
  const std::vector<double>& positions = plan.motion.position_rad;
  const double period = plan.motion.period_s;
  const double here = positions[k];
  const double before = k > 0 ? positions[k - 1] : here;
  const double after = k + 1 < positions.size() ? positions[k + 1] : here;
  return {plan.start_rad + here, 0.5 * (after - before) / period,
          k > 0 ? (after - 2.0 * here + before) / (period * period) : 0.0};
}

void make_room(Trace& trace, std::size_t steps) {
  for (auto* column : {&trace.motor_position_rad, &trace.motor_velocity_rad_s, &trace.output_position_rad,
                       &trace.current_a, &trace.gear_torque_nm, &trace.brake_torque_nm, &trace.dry_friction_nm}) {
    column->clear();
    column->reserve(steps);
  }
}

void append(Trace& trace, const State& state, double current_a) {
  trace.motor_position_rad.push_back(state.motor_position_rad);
  trace.motor_velocity_rad_s.push_back(state.motor_velocity_rad_s);
  trace.output_position_rad.push_back(state.output_position_rad);
  trace.current_a.push_back(current_a);
  trace.gear_torque_nm.push_back(state.gear_torque_nm);
  trace.brake_torque_nm.push_back(state.brake_torque_nm);
  trace.dry_friction_nm.push_back(state.contact_torque_nm);
}

State start_of(const Case& drive, const RecordPlan& plan) {
  State state;
  state.motor_position_rad = plan.start_rad;
  state.output_position_rad = plan.start_rad / drive.mechanics.gear_ratio;
  return state;
}

}  // namespace

double temperature_c(const RecordPlan& plan, double share_of_record) {
  const double risen = (1.0 - std::exp(-3.0 * share_of_record)) / (1.0 - std::exp(-3.0));
  return plan.temperature_start_c + (plan.temperature_end_c - plan.temperature_start_c) * risen;
}

void simulate(const Case& drive, const RecordPlan& plan, Trace& trace) {
  const auto per_period = static_cast<std::size_t>(std::lround(drive.control.period_s / drive.step_s));
  const std::size_t periods = plan.motion.position_rad.size();
  Plant plant(drive.mechanics, start_of(drive, plan));
  MotionController motion(drive.control, encoder_rad(drive.sensors, plan.start_rad));
  CurrentController current(drive.control, drive.mechanics.torque_constant_nm_a);
  const Disturbances& d = drive.disturbances;
  ColouredNoise motor_noise(d.motor_nm, d.motor_hz, drive.control.period_s, plan.noise_seed, "motor");
  ColouredNoise wind(d.wind_nm, d.wind_hz, drive.control.period_s, plan.noise_seed, "wind");
  trace.step_s = drive.step_s;
  make_room(trace, periods * per_period);
  double squared = 0.0;
  std::size_t saturated = 0;
  for (std::size_t k = 0; k < periods; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(periods);
    const SetPoint wanted = set_point_at(plan, k);
    const double command =
        motion.current_command_a(wanted, encoder_rad(drive.sensors, plant.state().motor_position_rad));
    const double drift = 1.0 + plan.drift_share * share;
    const double warmth = temperature_c(plan, share) - drive.reference_c;
    Inputs inputs{0.0,
                  motor_noise.next(),
                  wind.next(),
                  brake_level_nm(plan.brake, share),
                  plan.coulomb_scale * drift,
                  plan.viscous_scale * drift * std::exp(-drive.viscous_fall_1_c * warmth)};
    const double error = wanted.position_rad - plant.state().motor_position_rad;
    squared += error * error;
    saturated += motion.is_saturated() ? 1 : 0;
    for (std::size_t step = 0; step < per_period; ++step) {
      const double before_a = current.current_a();
      append(trace, plant.state(), before_a);
      const double after_a =
          current.step(command, plant.state().motor_velocity_rad_s, drive.sensors.current_offset_a, drive.step_s);
      inputs.current_a = 0.5 * (before_a + after_a);
      plant.step(inputs, drive.step_s);
    }
    if (!std::isfinite(plant.state().motor_velocity_rad_s)) break;
  }
  trace.tracking_rms_rad = std::sqrt(squared / static_cast<double>(periods));
  trace.saturated_share = static_cast<double>(saturated) / static_cast<double>(periods);
}

double dry_friction_share(const Case& drive, const RecordPlan& plan, const Trace& trace, std::size_t step) {
  const double velocity = trace.motor_velocity_rad_s[step];
  const double place = static_cast<double>(step) / static_cast<double>(trace.current_a.size());
  const double load = trace.gear_torque_nm[step] / drive.mechanics.gear_ratio;
  const FrictionState state{plan.coulomb_scale * (1.0 + plan.drift_share * place), 1.0, load};
  const double level = dry_level_nm(drive.mechanics.friction, state, velocity, velocity >= 0.0 ? 1.0 : -1.0);
  return level > 0.0 ? std::clamp(trace.dry_friction_nm[step] / level, -1.0, 1.0) : 0.0;
}

bool is_held(const RecordPlan& plan, const Trace& trace) {
  const auto [low, high] = std::minmax_element(plan.motion.position_rad.begin(), plan.motion.position_rad.end());
  return std::isfinite(trace.tracking_rms_rad) && std::isfinite(trace.motor_velocity_rad_s.back()) &&
         trace.tracking_rms_rad < 0.12 * (*high - *low) && trace.saturated_share < 0.08;
}

}  // namespace flexspline::worlds::drives
