#include "tests/worlds/drives/measure.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexspline::worlds::drives {
namespace {

double quantised(double value, double step) {
  return step > 0.0 ? step * std::floor(value / step + 0.5) : value;
}

double counted(double angle_rad, double counts_per_turn) {
  const double step = 2.0 * std::numbers::pi / counts_per_turn;
  return step * std::floor(angle_rad / step);
}

/// First-order low pass, exact for an input that is held for a step.
std::vector<double> low_passed(const std::vector<double>& column, double time_constant_s, double step_s) {
  if (time_constant_s <= 0.0) return column;
  const double gain = 1.0 - std::exp(-step_s / time_constant_s);
  std::vector<double> out(column.size());
  double value = column.front();
  for (std::size_t k = 0; k < column.size(); ++k) out[k] = value += gain * (column[k] - value);
  return out;
}

}  // namespace

double value_at(const std::vector<double>& column, double step_s, double time_s) {
  const double place = std::clamp(time_s / step_s, 0.0, static_cast<double>(column.size() - 1));
  const auto before = static_cast<std::size_t>(place);
  const auto after = std::min(before + 1, column.size() - 1);
  return column[before] + (place - static_cast<double>(before)) * (column[after] - column[before]);
}

Measured measure(const Case& drive, const RecordPlan& plan, const Trace& trace) {
  const Sensors& s = drive.sensors;
  Random random(plan.noise_seed, "sensors");
  const std::vector<double> filtered_current = low_passed(trace.current_a, s.current_filter_s, trace.step_s);
  const double zero_rad = s.knows_zero ? 0.0 : plan.start_rad;
  const double duration_s = static_cast<double>(trace.current_a.size()) * trace.step_s;
  // The first samples would show the delays' beginnings.
  const double first_s = 0.02 + 2.0 * (s.position_delay_s + s.current_delay_s);
  const auto samples = static_cast<std::size_t>((duration_s - first_s - 0.01) * s.rate_hz);
  Measured out{plan.name, plan.is_holdout, s.rate_hz, {}, {}, {}, {}, {}, {}, {}, {}, {}};
  for (std::size_t k = 0; k < samples; ++k) {
    const double nominal_s = static_cast<double>(k) / s.rate_hz;
    const double jitter_s = s.jitter_s * std::clamp(random.normal(), -3.0, 3.0);
    const double at_s = first_s + nominal_s + jitter_s;
    const double positions_s = at_s - s.position_delay_s;
    out.time_s.push_back(s.states_jitter ? nominal_s + jitter_s : nominal_s);
    const double current = value_at(filtered_current, trace.step_s, at_s - s.current_delay_s) + s.current_offset_a;
    out.current_a.push_back(quantised(current + s.current_noise_a * random.normal(), s.current_step_a));
    const double motor = value_at(trace.motor_position_rad, trace.step_s, positions_s);
    const double seen = motor + s.eccentricity_rad * std::sin(motor + s.eccentricity_phase_rad);
    out.motor_position_rad.push_back(counted(seen - zero_rad, s.motor_counts));
    if (s.has_velocity) {
      const double speed = value_at(trace.motor_velocity_rad_s, trace.step_s, positions_s);
      const double turning = 1.0 + s.eccentricity_rad * std::cos(motor + s.eccentricity_phase_rad);
      out.motor_velocity_rad_s.push_back(speed * turning + s.velocity_noise_rad_s * random.normal());
    }
    if (s.output_counts > 0.0) {
      const double output = value_at(trace.output_position_rad, trace.step_s, positions_s);
      out.output_position_rad.push_back(counted(output - zero_rad / drive.mechanics.gear_ratio, s.output_counts));
    }
    if (drive.mechanics.friction.presliding != Presliding::kRigid) {
      const auto step = static_cast<std::size_t>(
          std::clamp(positions_s / trace.step_s, 0.0, static_cast<double>(trace.current_a.size() - 1)));
      out.dry_friction_share.push_back(dry_friction_share(drive, plan, trace, step));
    }
    if (s.has_torque)
      out.torque_nm.push_back(value_at(trace.gear_torque_nm, trace.step_s, at_s) + s.torque_noise_nm * random.normal());
    if (s.has_load_torque) {
      out.load_torque_nm.push_back(value_at(trace.brake_torque_nm, trace.step_s, at_s) +
                                   s.torque_noise_nm * random.normal());
    }
    if (s.has_temperature) {
      out.temperature_c.push_back(quantised(temperature_c(plan, at_s / duration_s) + 0.03 * random.normal(), 0.0625));
    }
  }
  return out;
}

std::vector<Measured> recordings(const Case& drive, bool only_fit) {
  std::vector<Measured> out;
  Trace trace;
  for (const RecordPlan& plan : drive.records) {
    if (only_fit && plan.is_holdout) continue;
    simulate(drive, plan, trace);
    out.push_back(measure(drive, plan, trace));
  }
  return out;
}

}  // namespace flexspline::worlds::drives
