#include "tests/worlds/machines/hidden.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/worlds/machines/kinds.hpp"

namespace flexspline::worlds::machines {
namespace {

constexpr double kUsualSize = 0.3;
constexpr double kWorstTracking = 0.3;  // of the reference's standard deviation
constexpr int kSizes = 8;
constexpr double kCloseEnough = 0.12;  // of the wanted excess
constexpr double kLeastExcess = 0.03, kMostTooLarge = 1.6;

// The exact law with other parameters, or what adds the same column on every motion.
std::vector<std::string> accepted_names(const Machine& m, const std::string& effect) {
  if (effect == "stribeck_gaussian" || effect == "stribeck_hess_soom") {
    const std::string other = effect == "stribeck_gaussian" ? "stribeck_hess_soom" : "stribeck_gaussian";
    return {effect, other, "lugre_friction"};
  }
  if (effect == "presliding") return {"dahl_friction", "lugre_friction"};
  // Bouc-Wen with exponent 1 and Duhem with a linear curve are Dahl's equation.
  if (effect == "dahl_hysteresis") return {effect, "bouc_wen_hysteresis", "duhem_hysteresis"};
  if (effect == "coulomb_asymmetry" || effect == "current_offset") {
    std::vector<std::string> names = {effect, effect == "current_offset" ? "coulomb_asymmetry" : "current_offset",
                                      "torque_bias"};
    // A constant of the sensor shows in the transmission, too, where both sides are measured.
    if (m.sensors.torque && !m.sensors.output_encoder) names.emplace_back("torque_offset");
    return names;
  }
  return {effect};
}

double drawn_order(Kind kind, const std::string& effect, Dice& dice) {
  if (effect == "kinematic_error" || effect == "torque_sensor_ripple") return 2.0;
  if (effect != "torque_ripple") return 0.0;
  if (kind == Kind::telescope) return dice.one_of({36, 60, 108, 180});
  if (kind == Kind::rotary_table) return dice.one_of({36, 48, 60, 84, 108});
  return dice.one_of({6, 8, 12, 14, 24});
}

Wave wave_of(const HiddenEffect& h, double amplitude) {
  return {h.order, amplitude * std::cos(h.phase_rad), amplitude * std::sin(h.phase_rad)};
}

double plausible(const HiddenEffect& h, double size) {
  if (h.effect.ends_with("_asymmetry")) return std::min(size, 0.7);
  if (h.effect == "stribeck_gaussian" || h.effect == "power_law_friction") return std::min(size, 1.5);
  // Longer than any presliding that a machine has without its being hidden: a shorter one is sticking at rest.
  if (h.effect == "presliding") return std::max(size, 0.025);
  return size;
}

// False where the effect is none of the friction.
bool set_friction(const HiddenEffect& h, double size, const MotionLimits& limits, FrictionParameters& f) {
  const std::string& e = h.effect;
  if (e == "viscous_asymmetry") {
    f.viscous_asymmetry_nms_rad = size * h.sign * f.viscous_nms_rad;
  } else if (e == "coulomb_asymmetry") {
    f.coulomb_asymmetry_nm = size * h.sign * f.coulomb_nm;
  } else if (e == "stribeck_gaussian" || e == "stribeck_hess_soom") {
    f.stribeck_nm = size * f.coulomb_nm;
    f.stribeck_velocity_rad_s = h.velocity_rad_s;
    f.stribeck_is_hess_soom = e == "stribeck_hess_soom";
  } else if (e == "power_law_friction") {
    f.power_law_nm = size * f.coulomb_nm;
    f.power_law_exponent = h.exponent;
  } else if (e == "quadratic_drag") {
    f.quadratic_drag_nms2_rad2 = size * f.viscous_nms_rad / limits.velocity_rad_s;
  } else if (e == "load_dependent_friction") {
    f.load_coefficient = 0.05 * size;
  } else if (e == "temperature_viscous") {
    f.viscous_temperature_1_k += 0.01 * size;
  } else if (e == "temperature_coulomb") {
    f.coulomb_temperature_1_k += 0.01 * size;
  } else if (e == "presliding") {
    f.presliding_rad = 2e-3 * size * limits.range_rad;
    f.maxwell_slip = h.maxwell_slip;
    f.bristle_damping_nms_rad = 0.0;
  } else {
    return false;
  }
  return true;
}

void set_other(Machine& m, const HiddenEffect& h, double size) {
  const std::string& e = h.effect;
  Plant& p = m.plant;
  const double coulomb = p.friction.coulomb_nm, constant = p.electric.torque_constant_nm_a;
  if (e == "torque_ripple") {
    p.ripples_nm.resize(1);
    p.ripples_nm.push_back(wave_of(h, size * coulomb));
  } else if (e == "torque_sensor_ripple") {
    m.sensors.torque_ripple_nm = wave_of(h, size);
  } else if (e == "kinematic_error") {
    p.gear.kinematic_error_rad = wave_of(h, 4e-5 * size);
  } else if (e == "cubic_stiffness") {
    constexpr double kTorsion_rad = 2e-3;
    p.gear.cubic_stiffness_nm_rad3 = 0.3 * size * p.gear.stiffness_nm_rad / (kTorsion_rad * kTorsion_rad);
  } else if (e == "dahl_hysteresis") {
    p.gear.hysteresis_nm = size;
    p.gear.hysteresis_stiffness_nm_rad = 0.5 * p.gear.stiffness_nm_rad;
  } else if (e == "current_offset") {
    m.sensors.current_offset_a = size * h.sign * coulomb / constant;
  } else if (e == "torque_constant_saturation") {
    p.electric.saturation_1_a2 = 0.05 * size / (m.rated_current_a * m.rated_current_a);
  } else if (e == "current_delay") {
    p.electric.delay_s += 5e-4 * size;
  } else if (e == "gravity") {
    const double torque = size * coulomb * p.gear.ratio;
    p.load.gravity_sine_nm = torque * std::cos(h.phase_rad);
    p.load.gravity_cosine_nm = torque * std::sin(h.phase_rad);
  } else {
    throw std::logic_error("nothing to set for " + e);
  }
}

bool holds(const Machine& m, const std::vector<Record>& records) {
  try {
    for (const Record& r : records)
      if (!(tracking_error(r, simulate(m.plant, r.inputs)) < kWorstTracking)) return false;
  } catch (const std::runtime_error&) {
    return false;
  }
  return true;
}

// The RMS error with what is hidden left out of the model, over that with it, less 1; and what it would have to be
// multiplied by for the wanted one, if the squared error went with its square.
struct Excess {
  double now = 0.0, factor = 1.0;
};

Excess excess_of(const Machine& m) {
  const std::vector<Run> runs = run_all(m, m.fit);
  const HiddenTerms hidden = hidden_terms(m, runs);
  const double without = rms_error(m, runs, hidden.balance, {});
  const double with = rms_error(m, runs, hidden.balance, hidden.terms);
  const double wanted = 1.0 + m.hidden->wanted_excess;
  const double made = std::sqrt(std::max(without * without - with * with, 1e-6 * with * with));
  return {without / with - 1.0, with * std::sqrt(wanted * wanted - 1.0) / made};
}

// Steps by the factor that the last size asks for, between the sizes that were too small and too large.
void search_size(Machine& m, double& excess) {
  HiddenEffect& h = *m.hidden;
  double too_small = 0.0, too_large = INFINITY, size = kUsualSize;
  for (int k = 0; k < kSizes; ++k) {
    set_size(m, size);
    size = h.size;
    const Excess now = excess_of(m);
    excess = now.now;
    if (std::abs(excess - h.wanted_excess) < kCloseEnough * h.wanted_excess) return;
    (excess < h.wanted_excess ? too_small : too_large) = size;
    double next = size * std::clamp(now.factor, 0.15, 6.0);
    if (next <= too_small || next >= too_large) next = std::sqrt(std::max(too_small, 1e-3 * too_large) * too_large);
    if (!std::isfinite(next) || plausible(h, next) == size) return;
    size = next;
  }
}

}  // namespace

HiddenEffect draw_hidden(const Machine& machine, Dice& dice) {
  const auto& names = candidates(machine.kind);
  HiddenEffect h;
  h.effect = names[dice.below(names.size())];
  h.order = drawn_order(machine.kind, h.effect, dice);
  h.accepted = accepted_names(machine, h.effect);
  h.wanted_excess = dice.scale_between(0.10, 0.60);
  h.sign = dice.sign();
  h.phase_rad = dice.angle();
  h.velocity_rad_s = machine.limits.velocity_rad_s * dice.scale_between(0.02, 0.10);
  h.exponent = dice.between(0.4, 0.7);
  h.maxwell_slip = dice.with_chance(0.5);
  return h;
}

void set_size(Machine& machine, double size) {
  machine.plant = machine.plain_plant;
  machine.sensors = machine.plain_sensors;
  if (!machine.hidden) return;
  HiddenEffect& h = *machine.hidden;
  h.size = size > 0.0 ? plausible(h, size) : 0.0;
  if (h.size == 0.0) return;
  if (!set_friction(h, h.size, machine.limits, machine.plant.friction)) set_other(machine, h, h.size);
}

bool tune_controller(Machine& machine) {
  for (int attempt = 0; attempt < 5; ++attempt) {
    set_size(machine, kUsualSize);
    if (holds(machine, machine.fit) && holds(machine, machine.holdout)) return true;
    machine.plain_plant.controller.bandwidth_rad_s *= 0.6;
  }
  return false;
}

bool fit_size(Machine& machine) {
  if (!machine.hidden) return true;
  HiddenEffect& h = *machine.hidden;
  double excess = 0.0;
  try {
    search_size(machine, excess);
  } catch (const std::runtime_error&) {
    return false;
  }
  const bool far_too_large = excess > kMostTooLarge * h.wanted_excess && h.effect != "presliding";
  const bool useful = std::isfinite(excess) && excess > kLeastExcess && excess < 1.0 && !far_too_large;
  return useful && holds(machine, machine.fit) && holds(machine, machine.holdout);
}

}  // namespace flexspline::worlds::machines
