#include "hil/plant/physics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace flexspline::plant {
namespace {

using Apply = void (*)(const Effect&, const Drive&, Physics&);

// The catalogue's relays switch along an edge as wide as the distance of two levels. Here each consists of several
// ideal relays.
void add_relays(const Effect& e, const Drive&, Physics& p) {
  const double edge = e.value("span") / 9.0;
  for (int j = 1; j <= 9; ++j)
    for (int k = 1; k <= j; ++k) {
      const double weight = e.value(fmt::format("weight_{}{}", j, k));
      constexpr int kSharp = 6;
      for (int i = 0; weight != 0.0 && i < kSharp; ++i) {
        const double within = (2.0 * i + 1.0) / kSharp - 1.0;
        p.transmission.loops.relays.push_back(
            {edge * (2 * j - 9 + within), edge * (2 * k - 11 + within), weight / kSharp});
      }
    }
}

struct Applier {
  std::string_view effect;
  Apply apply;
};
constexpr Applier kAppliers[] = {
    {"inertia", [](const Effect& e, const Drive&, Physics& p) { p.motor_inertia = e.value("inertia"); }},
    {"viscous_friction",
     [](const Effect& e, const Drive&, Physics& p) { p.friction.viscous = e.value("coefficient"); }},
    {"coulomb_friction", [](const Effect& e, const Drive&, Physics& p) { p.friction.coulomb = e.value("torque"); }},
    {"viscous_asymmetry",
     [](const Effect& e, const Drive&, Physics& p) { p.friction.viscous_asymmetry = e.value("coefficient"); }},
    {"coulomb_asymmetry",
     [](const Effect& e, const Drive&, Physics& p) { p.friction.coulomb_asymmetry = e.value("torque"); }},
    {"stribeck_gaussian",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.stribeck.push_back(
           {e.value("amplitude_positive"), e.value("amplitude_negative"), e.value("velocity"), 2.0});
     }},
    {"stribeck_exponent",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.stribeck.push_back(
           {e.value("amplitude_positive"), e.value("amplitude_negative"), e.value("velocity"), e.value("exponent")});
     }},
    {"power_law_friction",
     [](const Effect& e, const Drive& d, Physics& p) {
       p.friction.power_torque = e.value("torque");
       p.friction.power_exponent = e.value("exponent");
       p.friction.power_reference = d.rated_velocity_rad_s;
     }},
    {"load_dependent_friction",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.load.push_back({e.value("coefficient"), 1.0, 1.0});
     }},
    {"load_dependent_stiction",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.load_stiction.push_back({e.value("coefficient"), e.value("velocity")});
     }},
    {"driving_dependent_loss",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.loss = {e.value("driving"), e.value("driven"), e.value("presliding")};
     }},
    {"load_power_friction",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.load.push_back({e.value("coefficient"), e.value("exponent"), e.value("reference")});
     }},
    {"temperature_viscous",
     [](const Effect& e, const Drive& d, Physics& p) {
       p.friction.temperature_coefficient = e.value("coefficient");
       p.friction.temperature_reference = d.temperature_reference_c;
     }},
    {"dahl_friction",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.dahl_torque = e.value("torque");
       p.friction.dahl_presliding = e.value("presliding");
     }},
    {"torque_ripple",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.ripple.push_back({e.value("order"), e.value("cosine"), e.value("sine")});
     }},
    {"triangle_ripple",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.triangle_ripple.push_back({e.value("order"), e.value("amplitude"), e.value("phase")});
     }},
    {"damaged_tooth",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.bumps.push_back({e.value("height"), e.value("angle"), e.value("width"), false});
     }},
    {"tight_spot",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.bumps.push_back({e.value("height"), e.value("angle"), e.value("width"), true});
     }},
    {"speed_onset",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.onsets.push_back({e.value("height"), e.value("velocity"), e.value("width")});
     }},
    // The sensor's error is not a torque: the recorder adds it to the reading.
    {"current_offset", [](const Effect&, const Drive&, Physics&) {}},
    {"linear_stiffness",
     [](const Effect& e, const Drive&, Physics& p) { p.transmission.stiffness = e.value("stiffness"); }},
    {"cubic_stiffness",
     [](const Effect& e, const Drive&, Physics& p) { p.transmission.cubic_stiffness = e.value("stiffness"); }},
    {"structural_damping",
     [](const Effect& e, const Drive&, Physics& p) {
       p.damping_torque = e.value("torque");
       p.damping_exponent = e.value("exponent");
     }},
    {"backlash",
     [](const Effect& e, const Drive&, Physics& p) { p.transmission.backlash_half_width = e.value("half_width"); }},
    {"output_inertia", [](const Effect& e, const Drive&, Physics& p) { p.output_inertia = e.value("inertia"); }},
    {"output_viscous_friction",
     [](const Effect& e, const Drive&, Physics& p) { p.output_viscous = e.value("coefficient"); }},
    {"output_coulomb_friction",
     [](const Effect& e, const Drive&, Physics& p) { p.output_coulomb = e.value("torque"); }},
    {"gravity",
     [](const Effect& e, const Drive&, Physics& p) {
       p.gravity_cosine = e.value("cosine");
       p.gravity_sine = e.value("sine");
     }},
    {"stribeck_hess_soom",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.hess_soom.push_back(
           {e.value("amplitude_positive"), e.value("amplitude_negative"), e.value("velocity")});
     }},
    {"quadratic_drag",
     [](const Effect& e, const Drive&, Physics& p) { p.friction.quadratic = e.value("coefficient"); }},
    {"temperature_coulomb",
     [](const Effect& e, const Drive& d, Physics& p) {
       p.friction.coulomb_temperature_coefficient = e.value("coefficient");
       p.friction.temperature_reference = d.temperature_reference_c;
     }},
    {"lugre_friction",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.lugre = {e.value("coulomb"), e.value("static"), e.value("velocity"), e.value("stiffness"),
                           e.value("damping")};
     }},
    {"load_scaled_ripple",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.load_ripple.push_back({e.value("order"), e.value("cosine"), e.value("sine")});
     }},
    {"angle_dependent_friction",
     [](const Effect& e, const Drive&, Physics& p) {
       p.friction.angle_friction.push_back({e.value("order"), e.value("cosine"), e.value("sine")});
     }},
    {"torque_constant_error",
     [](const Effect& e, const Drive&, Physics& p) { p.torque_constant *= 1.0 + e.value("ratio"); }},
    {"torque_constant_saturation",
     [](const Effect& e, const Drive&, Physics& p) { p.torque_saturation = e.value("coefficient"); }},
    {"current_saturation", [](const Effect& e, const Drive&, Physics& p) { p.current_limit_a = e.value("limit"); }},
    {"quadratic_stiffness",
     [](const Effect& e, const Drive&, Physics& p) { p.transmission.quadratic_stiffness = e.value("stiffness"); }},
    {"piecewise_stiffness",
     [](const Effect& e, const Drive&, Physics& p) {
       p.transmission.slopes = {e.value("stiffness_1"), e.value("stiffness_2"), e.value("stiffness_3"),
                                e.value("torque_1"), e.value("torque_2")};
     }},
    {"dahl_hysteresis",
     [](const Effect& e, const Drive&, Physics& p) {
       p.transmission.loops.dahl.push_back({e.value("torque"), e.value("stiffness"), e.value("exponent"), 0.0});
     }},
    {"modified_dahl_hysteresis",
     [](const Effect& e, const Drive&, Physics& p) {
       p.transmission.loops.dahl.push_back({e.value("torque"), e.value("stiffness"), 2.0, 0.0});
     }},
    {"torque_proportional_hysteresis",
     [](const Effect& e, const Drive&, Physics& p) {
       p.transmission.loops.dahl.push_back({e.value("torque"), e.value("stiffness"), 1.0, e.value("ratio")});
     }},
    {"duhem_hysteresis",
     [](const Effect& e, const Drive&, Physics& p) {
       p.transmission.loops.duhem.push_back({e.value("rate"),
                                             e.value("stiffness"),
                                             {e.value("phi_0"), e.value("phi_1"), e.value("phi_2"), e.value("phi_3")}});
     }},
    {"bouc_wen_hysteresis",
     [](const Effect& e, const Drive&, Physics& p) {
       p.transmission.loops.bouc_wen.push_back(
           {e.value("stiffness"), e.value("beta"), e.value("gamma"), e.value("exponent")});
     }},
    {"prandtl_ishlinskii_hysteresis",
     [](const Effect& e, const Drive&, Physics& p) {
       for (int j = 1; e.has(fmt::format("threshold_{}", j)); ++j)
         p.transmission.loops.plays.push_back(
             {e.value(fmt::format("threshold_{}", j)), e.value(fmt::format("weight_{}", j))});
     }},
    {"preisach_hysteresis", &add_relays},
    {"kinematic_error",
     [](const Effect& e, const Drive&,
        Physics&
            p) { p.transmission.kinematic_error.push_back({e.value("order"), e.value("cosine"), e.value("sine")}); }},
    // Errors of sensors are not torques: the recorder adds them to the readings, and delays the current.
    {"current_delay", [](const Effect&, const Drive&, Physics&) {}},
    {"torque_offset", [](const Effect&, const Drive&, Physics&) {}},
    {"torque_sensor_gain", [](const Effect&, const Drive&, Physics&) {}},
    {"torque_sensor_ripple", [](const Effect&, const Drive&, Physics&) {}},
    {"torsion_zero", [](const Effect&, const Drive&, Physics&) {}},
};

Apply applier_of(const std::string& effect) {
  for (const Applier& one : kAppliers)
    if (one.effect == effect) return one.apply;
  std::vector<std::string_view> all;
  for (const Applier& one : kAppliers) all.push_back(one.effect);
  std::sort(all.begin(), all.end());
  throw std::invalid_argument(
      fmt::format("the plant cannot simulate \"{}\"; take it out, or use one of {}", effect, fmt::join(all, ", ")));
}

}  // namespace

Physics physics_of(const Drive& drive) {
  Physics physics;
  physics.gear_ratio = drive.gear_ratio;
  physics.torque_constant = drive.torque_constant_nm_a;
  physics.friction.gear_ratio = drive.gear_ratio;
  for (const Effect& effect : drive.effects) {
    if (!effect.present) continue;
    const Apply apply = applier_of(effect.type);
    if (!effect.has("order") && drive.find(effect.type) != &effect) {
      throw std::invalid_argument(fmt::format("the effect \"{}\" is present twice; take one out", effect.type));
    }
    apply(effect, drive, physics);
  }
  if (physics.transmission.slopes.stiffness_1 > 0.0 || !physics.transmission.loops.duhem.empty())
    physics.transmission.stiffness = 0.0;  // these replace it
  if (!physics.transmission.loops.duhem.empty()) physics.damping_torque = 0.0;
  if (physics.friction.lugre.stiffness > 0.0) physics.friction.coulomb = 0.0;
  if (physics.friction.dahl_torque > 0.0) {
    if (!(physics.friction.dahl_presliding > 0.0)) {
      throw std::invalid_argument("dahl_friction: presliding must be positive");
    }
    physics.friction.coulomb = 0.0;  // the bristle replaces it
  }
  return physics;
}

SensorErrors sensor_errors_of(const Drive& drive) {
  SensorErrors errors;
  const auto value = [&](std::string_view type, std::string_view key) {
    const Effect* effect = drive.find(type);
    return effect == nullptr ? 0.0 : effect->value(key);
  };
  errors.current_offset_a = value("current_offset", "current");
  errors.current_delay_s = value("current_delay", "delay");
  errors.torque_offset_nm = value("torque_offset", "torque");
  errors.torque_gain = 1.0 + value("torque_sensor_gain", "ratio");
  errors.torsion_zero_rad = value("torsion_zero", "angle");
  for (const Effect& effect : drive.effects)
    if (effect.present && effect.type == "torque_sensor_ripple")
      errors.torque_ripple.push_back({effect.value("order"), effect.value("cosine"), effect.value("sine")});
  return errors;
}

}  // namespace flexspline::plant
