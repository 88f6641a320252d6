#include "hil/board/drive_setup.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hil/board/controller.hpp"
#include "hil/board/plant_rig.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::board {
namespace {

using N = firmware::N;

double stiffness_of(const plant::Drive& drive) {
  const plant::Effect* spring = drive.find("linear_stiffness");
  return spring == nullptr ? 0.0 : spring->value("stiffness");
}
// Without the hidden effects.
double breakaway_torque_of(const plant::Drive& drive) {
  const auto known = [&](const char* effect, const char* parameter) {
    const plant::Effect* found = drive.find(effect);
    return found == nullptr || found->hidden ? 0.0 : found->value(parameter);
  };
  return known("coulomb_friction", "torque") + std::max(0.0, known("stribeck_gaussian", "amplitude_positive"));
}
double inertia_of(const plant::Drive& drive) {
  const plant::Effect* inertia = drive.find("inertia");
  if (inertia == nullptr) throw std::runtime_error("the drive has no effect 'inertia'; its loops cannot be designed");
  return inertia->value("inertia");
}

double output_inertia_of(const plant::Drive& drive) {
  const plant::Effect* inertia = drive.find("output_inertia");
  return inertia == nullptr ? 0.0 : inertia->value("inertia");
}

template <class Effect>
void add_all(const plant::Drive& drive, const effects::DriveConstants<double>& d,
             model::DriveModel<N, model::ImageEffects>& model) {
  // Errors of sensors do not act on a shaft.
  for (const std::string_view of_sensor :
       {"torsion_zero", "torque_offset", "torque_sensor_gain", "torque_sensor_ripple"})
    if (Effect::kInfo.name == of_sensor) return;
  for (const plant::Effect& effect : drive.effects) {
    if (!effect.present || effect.hidden || effect.type != Effect::kInfo.name) continue;
    std::vector<double> values;
    for (const effects::ParameterInfo& p : Effect::kParameters) values.push_back(effect.value(p.name));
    if (!model.add<Effect>(Effect::template derive<N>(values.data(), d)))
      throw std::runtime_error("the drive has " + effect.type + " more often than its model has room for");
  }
}

}  // namespace

effects::DriveConstants<double> constants_of(const plant::Drive& drive, std::uint32_t tick_hz) {
  effects::DriveConstants<double> d;
  d.gear_ratio = drive.gear_ratio;
  d.torque_constant = drive.torque_constant_nm_a;
  d.rated_velocity = d.velocity_base = drive.rated_velocity_rad_s;
  d.reference_temperature = drive.temperature_reference_c;
  d.current_base = drive.current_limit_a;
  d.torque_base = drive.torque_constant_nm_a * drive.current_limit_a;
  d.output_torque_base = drive.rated_torque_nm;
  d.output_velocity_base = d.velocity_base / d.gear_ratio;
  d.acceleration_base = 2.0 * d.torque_base / inertia_of(drive);
  d.output_acceleration_base = d.acceleration_base / d.gear_ratio;
  d.torsion_base = drive.rated_torque_nm / std::max(stiffness_of(drive), 1.0);
  d.torsion_rate_base = d.output_velocity_base;
  d.angle_base = kTurn;
  d.temperature_base = 50.0;
  d.time_base = 1.0 / tick_hz;
  return d;
}

control::DriveSetup<double> setup_of(const plant::Drive& drive) {
  return setup_of(drive, constants_of(drive));
}

control::DriveSetup<double> setup_of(const plant::Drive& drive, const effects::DriveConstants<double>& d) {
  const AnalogScales scales = scales_of(drive);
  const double inertia = inertia_of(drive), stiffness = stiffness_of(drive);
  const double most_torque = d.torque_constant * drive.current_limit_a;
  control::DriveSetup<double> s;
  s.tick_hz = static_cast<std::uint32_t>(std::lround(1.0 / d.time_base));
  s.motor_counts = static_cast<std::uint32_t>(drive.sensors.motor_counts);
  s.output_counts = static_cast<std::uint32_t>(drive.sensors.output_counts);
  s.motor_corner = kTurn * 150.0;
  s.output_corner = kTurn * 50.0;
  s.has_torque_sensor = true;
  s.torsion = {.inertia = inertia,
               .output_inertia = output_inertia_of(drive),
               .stiffness = stiffness,
               .torque_noise = 0.01,
               .load_walk = 1.0,
               .velocity_noise = 0.3};
  s.ripple = {.order = 2.0, .memory = kTurn * 20.0, .largest_ripple = 0.05 * drive.rated_torque_nm};
  s.disturbance = {.inertia = inertia, .time_constant_s = 0.01, .limit = 1.9 * d.torque_base};
  s.current = {.full_scale = scales.current_a};
  s.torque = {.full_scale = scales.torque_nm};
  s.temperature = {.full_scale = scales.temperature_c};
  s.amplifier_full_scale = scales.amplifier_a;
  const double velocity_gain = inertia * 200.0;
  s.loops = {.position_gain = 30.0,
             .velocity_gain = velocity_gain,
             .integral_gain = velocity_gain * 40.0,
             .velocity_limit = drive.rated_velocity_rad_s,
             .overspeed = 1.15 * drive.rated_velocity_rad_s,
             .torque_limit = most_torque,
             .current_limit = drive.current_limit_a};
  s.trajectory = {.velocity_limit = drive.rated_velocity_rad_s, .acceleration_limit = 0.5 * most_torque / inertia};
  s.feedforward = {.direction_band = 1e-4 * d.velocity_base,
                   .torque_limit = 1.9 * d.torque_base,
                   .load_limit = 1.9 * drive.rated_torque_nm,
                   .stiffness = stiffness,
                   .torsion_limit = 1.9 * d.torsion_base,
                   .torsion_rate_limit = 0.5 * d.velocity_base / d.gear_ratio};
  // The drive does not know hidden effects.
  if (const plant::Effect* damping = drive.find("structural_damping"); damping != nullptr && !damping->hidden) {
    s.feedforward.damping_torque = damping->value("torque");
    s.feedforward.damping_exponent = damping->value("exponent");
  }
  s.residual_map = {.standstill_velocity = 0.5,
                    .largest_velocity = drive.rated_velocity_rad_s,
                    .largest_residual = 0.25 * most_torque};
  s.safety.overspeed = 1.25 * drive.rated_velocity_rad_s;
  s.safety.overcurrent = 1.2 * drive.current_limit_a;
  s.safety.overtemperature = 80.0;
  s.safety.acceleration = 10.0 * most_torque / inertia;
  // A torque changes by twice its limit at most.
  s.safety.stuck_torque = std::min(std::max(0.5 * most_torque, 3.0 * breakaway_torque_of(drive)), 1.85 * most_torque);
  s.safety.current_mismatch = 0.2 * drive.current_limit_a;
  s.safety.following_error = 2.0 * drive.rated_velocity_rad_s / s.loops.position_gain;
  s.safety.following_velocity = 0.75 * drive.rated_velocity_rad_s;
  // Torsion swings by less than four of its bases.
  s.safety.output_stuck = 8.0 * d.torsion_base;
  return s;
}

namespace {
void require_no_findings() {
  if (fixed::OverflowLog::count() != 0)
    throw std::runtime_error("the drive's parameters do not fit its numbers: " +
                             std::string(fixed::OverflowLog::first()));
}
}  // namespace

firmware::Parameters parameters_of(const plant::Drive& drive, const control::DriveSetup<double>& setup) {
  const effects::DriveConstants<double> d = constants_of(drive, setup.tick_hz);
  fixed::OverflowLog::clear();
  firmware::Parameters parameters = control::derive<N>(setup, d);
  parameters.model.for_each(
      [&]<class Effect>(model::Places<Effect, N>&) { add_all<Effect>(drive, d, parameters.model); });
  require_no_findings();
  return parameters;
}

}  // namespace flexspline::board
