#include "tests/worlds/machines/friction.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace flexspline::worlds::machines {
namespace {

// Of the Maxwell-slip elements: shares of the torque, and travels until they slip over the presliding length.
constexpr std::array<double, 4> kShares = {0.4, 0.3, 0.2, 0.1};
constexpr std::array<double, 4> kTravels = {0.25, 0.6, 1.3, 3.0};
constexpr double kLeast = 0.05;  // of the Coulomb friction, that is left at any speed

double sign(double x) {
  return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}

}  // namespace

MachineFriction::MachineFriction(const FrictionParameters& parameters, double gear_ratio, double step_s)
    : p_(parameters), ratio_(gear_ratio), step_s_(step_s) {}

double MachineFriction::over_position(double angle_rad) const {
  if (p_.over_position.empty()) return 0.0;
  const std::size_t size = p_.over_position.size();
  const double turns = angle_rad / p_.position_period_rad;
  const double at = (turns - std::floor(turns)) * static_cast<double>(size);
  const std::size_t k = static_cast<std::size_t>(at) % size;
  const double part = at - std::floor(at);
  return p_.over_position[k] + part * (p_.over_position[(k + 1) % size] - p_.over_position[k]);
}

// Bristles under a constant velocity within the step have a closed form, so that short ones need no short steps.
double MachineFriction::turn_bristles(double level_nm, double velocity_rad_s, double& direction) {
  const double stiffness = p_.coulomb_nm / p_.presliding_rad, heading = sign(velocity_rad_s);
  const double before = bristle_nm_;
  if (heading != 0.0) {
    const double end = heading * level_nm;
    bristle_nm_ = end + (before - end) * std::exp(-std::abs(velocity_rad_s) * step_s_ * stiffness / level_nm);
  }
  direction = bristle_nm_ / level_nm;
  return bristle_nm_ + p_.bristle_damping_nms_rad * (bristle_nm_ - before) / (stiffness * step_s_);
}

double MachineFriction::slip_elements(double level_nm, double velocity_rad_s, double& direction) {
  direction = 0.0;
  for (std::size_t j = 0; j < elements_.size(); ++j) {
    const double travel = velocity_rad_s * step_s_ / (kTravels[j] * p_.presliding_rad);
    elements_[j] = std::clamp(elements_[j] + travel, -1.0, 1.0);
    direction += kShares[j] * elements_[j];
  }
  return level_nm * direction;
}

double MachineFriction::advance(const SlidingState& state, Sample& sample) {
  const double w = state.velocity_rad_s, speed = std::abs(w);
  sample.viscous_nm = p_.viscous_nms_rad * w;
  sample.viscous_temperature_nm = p_.viscous_nms_rad * (state.viscous_thermal - 1.0) * w;
  sample.viscous_asymmetry_nm = p_.viscous_asymmetry_nms_rad * speed;
  sample.drag_nm = p_.quadratic_drag_nms2_rad2 * w * speed;

  double stribeck = 0.0, power = 0.0;
  if (p_.stribeck_nm != 0.0) {
    const double x = w / p_.stribeck_velocity_rad_s;
    stribeck = p_.stribeck_is_hess_soom ? p_.stribeck_nm / (1.0 + x * x) : p_.stribeck_nm * std::exp(-x * x);
  }
  if (p_.power_law_nm != 0.0)
    power = p_.power_law_nm * std::pow(speed / p_.reference_velocity_rad_s, p_.power_law_exponent);
  const double by_load = p_.load_coefficient * std::abs(state.gear_torque_nm) / ratio_;
  const double thermal = p_.coulomb_nm * (state.coulomb_thermal - 1.0);
  const double asymmetry = p_.coulomb_asymmetry_nm * sign(w);
  const double position = p_.coulomb_nm * over_position(state.angle_rad);
  const double level =
      std::max(kLeast * p_.coulomb_nm, p_.coulomb_nm + stribeck + power + by_load + thermal + asymmetry + position);

  double direction = 0.0;
  const double bristles = p_.maxwell_slip ? slip_elements(level, w, direction) : turn_bristles(level, w, direction);
  sample.direction = direction;
  sample.stribeck_nm = stribeck * direction;
  sample.power_law_nm = power * direction;
  sample.load_friction_nm = by_load * direction;
  sample.coulomb_temperature_nm = thermal * direction;
  sample.coulomb_asymmetry_nm = asymmetry * direction;
  sample.position_friction_nm = position * direction;
  return sample.viscous_nm + sample.viscous_temperature_nm + sample.viscous_asymmetry_nm + sample.drag_nm + bristles;
}

}  // namespace flexspline::worlds::machines
