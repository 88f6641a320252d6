// The settings of a block in SI, as `unpack` lists them: the inverse of what drive_parameters_setup.hpp derives.
#include <cmath>
#include <cstdlib>
#include <limits>

#include "host/drive_link/deployment/drive_settings.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::deployment {
namespace {

using effects::DriveConstants;
using FixedSettings = control::DriveSettings<fixed::Fixed>;
using Quantities = std::vector<NamedQuantity>;

double in(fixed::Value x, double base) {
  return std::ldexp(x.raw, -fixed::kValueBits) * base;
}
double gain(const auto& g) {
  return std::ldexp(g.mantissa, g.exponent - fixed::kMantissaBits);
}
double share(fixed::Share x) {
  return std::ldexp(static_cast<double>(x.raw), -fixed::kShareBits);
}

void add_loops(const FixedSettings& s, const DriveConstants<double>& d, Quantities& all) {
  const double speed = std::ldexp(d.angle_base / d.time_base, -48);
  all.insert(all.end(),
             {{"tick_rate", static_cast<double>(s.tick_hz), "Hz"},
              {"motor_encoder_counts", static_cast<double>(s.motor_encoder.counts), ""},
              {"output_encoder_counts", s.has_output_encoder ? static_cast<double>(s.output_encoder.counts) : 0.0, ""},
              {"position_gain", gain(s.loops.position) * d.velocity_base / d.angle_base, "1/s"},
              {"velocity_gain", gain(s.loops.velocity) * d.torque_base / d.velocity_base, "N*m*s/rad"},
              {"integral_gain", share(s.loops.integral) * d.torque_base / (d.velocity_base * d.time_base), "N*m/rad"},
              {"torque_limit", in(s.loops.torque_limit, d.torque_base), "N*m"},
              {"current_limit", in(s.loops.current_limit, d.current_base), "A"},
              {"velocity_limit", in(s.loops.velocity_limit, d.velocity_base), "rad/s"},
              {"no_torque_drives_above", in(s.loops.guard.overspeed, d.velocity_base), "rad/s"},
              {"acceleration_limit", static_cast<double>(s.trajectory.change) * speed / d.time_base, "rad/s^2"}});
}

void add_sensors(const FixedSettings& s, const DriveConstants<double>& d, Quantities& all) {
  all.insert(all.end(), {{"current_sensor_full_scale", gain(s.current.gain) * d.current_base, "A"},
                         {"torque_sensor_full_scale",
                          s.has_torque_sensor ? gain(s.torque.gain) * d.output_torque_base : 0.0, "N*m"},
                         {"temperature_sensor_full_scale", gain(s.temperature.gain) * d.temperature_base, "degC"},
                         {"amplifier_full_scale", d.current_base / gain(s.amplifier), "A"},
                         {"direction_band", d.velocity_base / gain(s.feedforward.per_band), "rad/s"}});
}

void add_faults(const FixedSettings& s, const DriveConstants<double>& d, Quantities& all) {
  const auto seconds = [&](std::uint32_t ticks) { return ticks * d.time_base; };
  all.insert(
      all.end(),
      {{"fault_overspeed", in(s.safety.overspeed, d.velocity_base), "rad/s"},
       {"fault_overcurrent", in(s.safety.overcurrent, d.current_base), "A"},
       {"fault_overtemperature", in(s.safety.overtemperature, d.temperature_base), "degC"},
       {"fault_acceleration", in(s.safety.acceleration, d.acceleration_base), "rad/s^2"},
       {"fault_host", seconds(s.safety.host_ticks), "s"},
       {"fault_stop", seconds(s.safety.stop_ticks), "s"},
       {"fault_following_error", std::ldexp(static_cast<double>(s.following.position), -32) * d.angle_base, "rad"},
       {"fault_following_velocity", in(s.following.velocity, d.velocity_base), "rad/s"},
       {"fault_following", seconds(s.following.ticks), "s"},
       {"fault_output_stuck", s.following.motor_counts * d.angle_base / (d.gear_ratio * s.motor_encoder.counts), "rad"},
       {"residual_map_largest",
        s.residual_map.scale == 0
            ? 0.0
            : control::ResidualMap::kLargest * d.torque_base * 0x1p27 / static_cast<double>(s.residual_map.scale),
        "N*m"},
       {"excitation", seconds(s.excitation.ticks), "s"},
       {"fault_stuck_torque", in(s.safety.stuck_torque, d.torque_base), "N*m"},
       {"fault_stuck", seconds(s.safety.stuck_ticks), "s"},
       {"fault_current_mismatch", in(s.safety.current_mismatch, d.current_base), "A"},
       {"fault_mismatch", seconds(s.safety.mismatch_ticks), "s"},
       {"fault_torque_same", seconds(s.safety.torque_same_ticks), "s"},
       {"fault_standstill", in(s.safety.standstill, d.velocity_base), "rad/s"},
       {"residual_map_standstill", in({s.residual_map.edges.front()}, d.velocity_base), "rad/s"},
       {"residual_map_highest_velocity", in({s.residual_map.edges.back()}, d.velocity_base), "rad/s"}});
}

// A drive truncates a position to 2^-32 turns, towards zero: half of one more gives the same one again.
void add_position_limits(const FixedSettings& s, const DriveConstants<double>& d, Quantities& all) {
  constexpr std::int64_t kNone = std::int64_t{1} << 62;
  const auto add = [&](const char* name, std::int64_t q32) {
    if (std::abs(q32) >= kNone) return;
    const double half = q32 == 0 ? 0.0 : std::copysign(0.5, static_cast<double>(q32));
    all.push_back({name, std::ldexp(static_cast<double>(q32) + half, -32) * d.angle_base, "rad"});
  };
  add("lowest_position", s.trajectory.lowest);
  add("highest_position", s.trajectory.highest);
}

void add_analog(const std::string& name, const control::AnalogScale<fixed::Fixed>& x, double base, const char* unit,
                Quantities& all) {
  // Truncated towards zero as well.
  const auto of_converter = [](std::int16_t raw) {
    const double half = raw == 0 || std::abs(raw) == 32767 ? 0.0 : std::copysign(0.5, static_cast<double>(raw));
    return (raw + half) / 32767.0;
  };
  all.push_back({name + "_at_zero", in(x.offset, base), unit});
  all.push_back({name + "_lowest_share", of_converter(x.lowest), ""});
  all.push_back({name + "_highest_share", of_converter(x.highest), ""});
}

void add_observers(const FixedSettings& s, const DriveConstants<double>& d, Quantities& all) {
  const double seldom_s = s.has_slow_rates ? control::slow(d).time_base : d.time_base;
  all.push_back({"motor_filter_corner", share(s.motor_motion.tick) / (kTurn * d.time_base), "Hz"});
  if (s.has_output_encoder)
    all.push_back({"output_filter_corner", share(s.output_motion.tick) / (kTurn * seldom_s), "Hz"});
  if (const double kept = 1.0 - share(s.disturbance.share); kept > 0.0 && kept < 1.0)
    all.push_back({"disturbance_time_constant", -seldom_s / std::log(kept), "s"});
  all.push_back({"disturbance_inertia", gain(s.disturbance.inertia) * d.torque_base / d.acceleration_base, "kg*m^2"});
  if (s.has_torque_sensor) {
    const double cycles = std::ldexp(static_cast<double>(s.ripple.order.raw), -fixed::kOrderBits);
    all.push_back({"ripple_order", cycles * kTurn / (d.turn_angle_scale * d.angle_base), ""});
    // An amplitude follows with a third of a step (shared/observers/ripple_filter.hpp).
    all.push_back({"ripple_memory", 3.0 * d.angle_base / gain(s.ripple.per_travel), "rad"});
    all.push_back({"ripple_largest", in(s.ripple.largest, d.output_torque_base), "N*m"});
  }
  if (s.has_output_encoder) return;
  const auto& t = s.torsion;
  const double load = d.time_base * d.output_torque_base / (share(t.by_load) * d.output_velocity_base);
  all.insert(all.end(), {{"load_inertia", load, "kg*m^2"},
                         {"load_stiffness",
                          share(t.output) * load * d.output_velocity_base / (d.time_base * d.torsion_base), "N*m/rad"},
                         {"torsion_observer_velocity", gain(t.velocity), ""},
                         {"torsion_observer_torsion", gain(t.torsion), ""},
                         {"torsion_observer_output", gain(t.output_velocity), ""},
                         {"torsion_observer_load", gain(t.load), ""}});
}

void add_feedforward(const FixedSettings& s, const DriveConstants<double>& d, Quantities& all) {
  const auto& f = s.feedforward;
  all.push_back({"output_zero", std::ldexp(static_cast<double>(-f.to_output_zero.raw), -32), "turns"});
  if (!f.leads) return;
  const double lead_s = (s.has_slow_rates ? control::Feedforward::kLeadTicks : 1) * d.time_base;
  all.push_back({"torsion_rate_limit", in(f.torsion_change, d.torsion_base) / lead_s, "rad/s"});
  all.push_back({"feedforward_stiffness", d.output_torque_base / (gain(f.compliance) * d.torsion_base), "N*m/rad"});
}

}  // namespace

std::vector<NamedQuantity> described(const FixedSettings& s, const DriveConstants<double>& d) {
  Quantities all;
  add_loops(s, d, all);
  add_sensors(s, d, all);
  add_faults(s, d, all);
  add_position_limits(s, d, all);
  add_analog("current_sensor", s.current, d.current_base, "A", all);
  if (s.has_torque_sensor) add_analog("torque_sensor", s.torque, d.output_torque_base, "N*m", all);
  add_analog("temperature_sensor", s.temperature, d.temperature_base, "degC", all);
  add_observers(s, d, all);
  add_feedforward(s, d, all);
  return all;
}

}  // namespace flexspline::deployment
