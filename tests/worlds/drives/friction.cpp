#include "tests/worlds/drives/friction.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexspline::worlds::drives {

double dry_level_nm(const FrictionLaw& law, const FrictionState& state, double velocity_rad_s, double direction) {
  double level = law.coulomb_nm * state.coulomb_scale + direction * law.coulomb_asymmetry_nm;
  const double stribeck = direction > 0.0 ? law.stribeck_positive_nm : law.stribeck_negative_nm;
  if (stribeck != 0.0) {
    const double ratio = velocity_rad_s / law.stribeck_velocity_rad_s;
    level += stribeck * std::exp(-ratio * ratio);
  }
  if (law.power_nm != 0.0) {
    level += law.power_nm * std::pow(std::abs(velocity_rad_s) / law.reference_velocity_rad_s, law.power_exponent);
  }
  level += law.load_coefficient * std::abs(state.load_nm);
  return std::max(level, 0.0);
}

double fluid_friction_nm(const FrictionLaw& law, const FrictionState& state, double velocity_rad_s) {
  return law.viscous_nms_rad * state.viscous_scale * velocity_rad_s +
         (law.viscous_asymmetry_nms_rad + law.quadratic_nms2_rad2 * velocity_rad_s) * std::abs(velocity_rad_s);
}

double steady_friction_nm(const FrictionLaw& law, const FrictionState& state, double velocity_rad_s) {
  if (velocity_rad_s == 0.0) return 0.0;
  const double direction = velocity_rad_s > 0.0 ? 1.0 : -1.0;
  return direction * dry_level_nm(law, state, velocity_rad_s, direction) +
         fluid_friction_nm(law, state, velocity_rad_s);
}

double after_dry_friction(double free_velocity_rad_s, double level_positive_nm, double level_negative_nm,
                          double step_over_inertia) {
  if (free_velocity_rad_s > 0.0) return std::max(0.0, free_velocity_rad_s - step_over_inertia * level_positive_nm);
  return std::min(0.0, free_velocity_rad_s + step_over_inertia * level_negative_nm);
}

double contact_torque_nm(const FrictionLaw& law, double torque_nm, double travel_rad, double level_nm) {
  if (travel_rad == 0.0 || level_nm <= 0.0) return level_nm <= 0.0 ? 0.0 : torque_nm;
  const double stiffness_nm_rad = law.coulomb_nm / law.presliding_rad;
  const double direction = travel_rad > 0.0 ? 1.0 : -1.0;
  if (law.presliding == Presliding::kDahl) {
    const double bound = direction * level_nm;
    return bound + (torque_nm - bound) * std::exp(-stiffness_nm_rad * std::abs(travel_rad) / level_nm);
  }
  const double share = direction * torque_nm / level_nm;
  constexpr double kBreakaway = 0.7;
  double sliding = 0.0;
  if (share >= 1.0) {
    sliding = 1.0;
  } else if (share > kBreakaway) {
    sliding = 0.5 - 0.5 * std::cos(std::numbers::pi * (share - kBreakaway) / (1.0 - kBreakaway));
  }
  const double next = torque_nm + stiffness_nm_rad * travel_rad * (1.0 - sliding * share);
  return std::clamp(next, -level_nm, level_nm);
}

}  // namespace flexspline::worlds::drives
