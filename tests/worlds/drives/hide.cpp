#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "tests/worlds/drives/draw.hpp"

namespace flexspline::worlds::drives {
namespace {

double used_velocity_rad_s(const Case& drive, const Kind& kind) {
  return drive.rated_velocity_rad_s * std::sqrt(kind.used_velocity.low * kind.used_velocity.high);
}

void hide_ripple(Case& drive, const Kind& kind, Random& random) {
  // Once a turn: rotor or screw; twice the pole pairs and more: cogging. Fast motors pass high orders above any
  // bandwidth.
  const bool is_slow = kind.name == "rotary-table" || kind.name == "gimbal" || kind.name == "leg";
  double order = is_slow ? random.one_of(std::vector<double>{2.0, 6.0}) * drive.pole_pairs : random.integer(1, 3);
  if (kind.name == "leg") order = 6.0 * random.integer(1, 4);
  if (!drive.residual_ripples.empty() && drive.residual_ripples.front().order == order) {
    drive.residual_ripples.clear();
    drive.mechanics.ripples.clear();
  }
  const double size = drive.mechanics.friction.coulomb_nm * random.uniform(0.15, 0.6);
  const double phase = random.uniform(0.0, 2.0 * std::numbers::pi);
  drive.mechanics.ripples.push_back({order, size * std::cos(phase), size * std::sin(phase)});
  drive.sensors.knows_zero = true;
  drive.hidden.order = order;
  drive.hidden.parameters = {{"amplitude_nm", size}};
}

void hide_delay(Case& drive, Random& random) {
  Sensors& s = drive.sensors;
  const double late_s = std::min(random.uniform(3.0, 10.0) / s.rate_hz, 0.03);
  const bool is_current = random.chance(0.5);
  s.current_filter_s = 0.0;
  s.current_delay_s = is_current ? late_s : 0.0;
  s.position_delay_s = is_current ? 0.0 : late_s;
  // In the catalogue's sign: positive where the current acts later than the log says.
  drive.hidden.parameters = {{"delay_s", is_current ? -late_s : late_s}};
}

void hide_in_spring(Case& drive, std::string_view effect, Random& random) {
  Mechanics& m = drive.mechanics;
  const double used_rad = 0.4 * m.torque_constant_nm_a * drive.rated_current_a * m.gear_ratio / m.stiffness_nm_rad;
  if (effect == "backlash") {
    m.backlash_rad = used_rad * random.uniform(0.05, 0.4);
    drive.hidden.parameters = {{"half_width_rad", m.backlash_rad}};
  } else {
    m.cubic_nm_rad3 = m.stiffness_nm_rad / (used_rad * used_rad) * random.uniform(0.2, 1.5);
    drive.hidden.parameters = {{"stiffness_nm_rad3", m.cubic_nm_rad3}};
  }
}

void hide_in_friction(Case& drive, const Kind& kind, std::string_view effect, Random& random) {
  FrictionLaw& f = drive.mechanics.friction;
  const double used_rad_s = used_velocity_rad_s(drive, kind);
  const double coulomb = f.coulomb_nm;
  if (effect == "stribeck_gaussian") {
    const double size = coulomb * random.uniform(0.15, 0.6);
    f.stribeck_positive_nm = size * random.uniform(0.85, 1.15);
    f.stribeck_negative_nm = size * random.uniform(0.85, 1.15);
    f.stribeck_velocity_rad_s = used_rad_s * random.log_uniform(0.02, 0.12);
    drive.hidden.parameters = {{"amplitude_nm", size}, {"velocity_rad_s", f.stribeck_velocity_rad_s}};
  } else if (effect == "power_law_friction") {
    f.power_nm = coulomb * random.uniform(0.8, 2.5);
    f.power_exponent = random.uniform(0.35, 0.65);
    drive.hidden.parameters = {{"torque_nm", f.power_nm}, {"exponent", f.power_exponent}};
  } else if (effect == "quadratic_drag") {
    f.quadratic_nms2_rad2 = coulomb * random.uniform(0.3, 1.2) / (used_rad_s * used_rad_s);
    drive.hidden.parameters = {{"coefficient_nms2_rad2", f.quadratic_nms2_rad2}};
  } else if (effect == "coulomb_asymmetry") {
    f.coulomb_asymmetry_nm = random.sign() * coulomb * random.uniform(0.05, 0.3);
    drive.hidden.parameters = {{"torque_nm", f.coulomb_asymmetry_nm}};
  } else if (effect == "viscous_asymmetry") {
    f.viscous_asymmetry_nms_rad = random.sign() * f.viscous_nms_rad * random.uniform(0.1, 0.5);
    drive.hidden.parameters = {{"coefficient_nms_rad", f.viscous_asymmetry_nms_rad}};
  } else if (effect == "load_dependent_friction") {
    f.load_coefficient = random.uniform(0.03, 0.15);
    drive.hidden.parameters = {{"coefficient", f.load_coefficient}};
  } else if (effect == "dahl_friction") {
    f.presliding = Presliding::kDahl;
    f.presliding_rad *= random.uniform(2.0, 10.0);
    drive.hidden.parameters = {{"presliding_rad", f.presliding_rad}};
  }
}

}  // namespace

void hide(Case& drive, const Kind& kind, std::string_view effect, Random& random) {
  drive.hidden.effect = effect;
  Mechanics& m = drive.mechanics;
  if (effect == "torque_ripple") {
    hide_ripple(drive, kind, random);
  } else if (effect == "current_delay") {
    hide_delay(drive, random);
  } else if (effect == "backlash" || effect == "cubic_stiffness") {
    hide_in_spring(drive, effect, random);
  } else if (effect == "gravity") {
    m.gravity_nm = m.friction.coulomb_nm * m.gear_ratio * random.uniform(0.3, 1.5);
    m.gravity_phase_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    drive.sensors.knows_zero = true;
    drive.hidden.parameters = {{"amplitude_nm", m.gravity_nm}, {"phase_rad", m.gravity_phase_rad}};
  } else if (effect == "current_offset") {
    drive.sensors.current_offset_a = random.sign() * drive.rated_current_a * random.log_uniform(0.004, 0.04);
    drive.hidden.parameters = {{"current_a", drive.sensors.current_offset_a}};
  } else if (effect == "torque_constant_saturation") {
    // A loss of 13 to 30 % at the limit: the torque still rises there.
    m.saturation_1_a2 =
        random.uniform(0.4, 0.9) / (3.0 * drive.control.current_limit_a * drive.control.current_limit_a);
    drive.hidden.parameters = {{"coefficient_1_a2", m.saturation_1_a2}};
  } else if (effect == "temperature_viscous") {
    drive.sensors.has_temperature = true;
    drive.viscous_fall_1_c = random.uniform(0.008, 0.03);
    drive.hidden.parameters = {{"coefficient_1_c", drive.viscous_fall_1_c}};
  } else {
    hide_in_friction(drive, kind, effect, random);
    if (drive.hidden.parameters.empty())
      throw std::invalid_argument("effect '" + std::string(effect) + "' is not known");
  }
}

}  // namespace flexspline::worlds::drives
