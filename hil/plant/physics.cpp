#include "hil/plant/physics.hpp"

#include <fmt/format.h>

#include <functional>
#include <map>
#include <stdexcept>

namespace flexspline::plant {
namespace {

using Apply = std::function<void(const Effect&, const Drive&, Physics&)>;

const std::map<std::string, Apply, std::less<>>& appliers() {
  static const std::map<std::string, Apply, std::less<>> kAppliers = {
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
      // The sensor's error is no torque: the recorder adds it to the reading.
      {"current_offset", [](const Effect&, const Drive&, Physics&) {}},
      {"linear_stiffness", [](const Effect& e, const Drive&, Physics& p) { p.stiffness = e.value("stiffness"); }},
      {"cubic_stiffness", [](const Effect& e, const Drive&, Physics& p) { p.cubic_stiffness = e.value("stiffness"); }},
      {"structural_damping",
       [](const Effect& e, const Drive&, Physics& p) {
         p.damping_torque = e.value("torque");
         p.damping_exponent = e.value("exponent");
       }},
      {"backlash", [](const Effect& e, const Drive&, Physics& p) { p.backlash_half_width = e.value("half_width"); }},
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
  };
  return kAppliers;
}

}  // namespace

Physics physics_of(const Drive& drive) {
  Physics physics;
  physics.gear_ratio = drive.gear_ratio;
  physics.torque_constant = drive.torque_constant_nm_a;
  physics.friction.gear_ratio = drive.gear_ratio;
  for (const Effect& effect : drive.effects) {
    if (!effect.present) continue;
    const auto found = appliers().find(effect.type);
    if (found == appliers().end()) {
      std::string all;
      for (const auto& [name, apply] : appliers()) all += (all.empty() ? "" : ", ") + name;
      throw std::invalid_argument(
          fmt::format("the plant cannot simulate \"{}\"; take it out, or use one of {}", effect.type, all));
    }
    if (!effect.has("order") && drive.find(effect.type) != &effect) {
      throw std::invalid_argument(fmt::format("the effect \"{}\" is present twice; take one out", effect.type));
    }
    found->second(effect, drive, physics);
  }
  if (physics.friction.dahl_torque > 0.0) {
    if (!(physics.friction.dahl_presliding > 0.0)) {
      throw std::invalid_argument("dahl_friction: presliding must be positive");
    }
    physics.friction.coulomb = 0.0;  // the bristle stands in for it
  }
  return physics;
}

double current_offset_of(const Drive& drive) {
  const Effect* offset = drive.find("current_offset");
  return offset == nullptr ? 0.0 : offset->value("current");
}

}  // namespace flexspline::plant
