#include "hil/rhs100/models.hpp"

#include <fmt/format.h>

#include <initializer_list>
#include <string_view>

#include "hil/rhs100/experiments.hpp"
#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/published_tables.hpp"

namespace flexspline::rhs100 {
namespace {

namespace published = report::published;

std::string gear_drive(std::string_view name) {
  return fmt::format(R"(format = "flexspline-model/1"
name = "{}"

[drive]
axis = "rotary"
gear_ratio = {:.1f}
torque_constant_nm_a = {{ value = 4.275e-2, source = "report, table 3" }}
rated_current_a = 3.5
rated_velocity_rad_s = {:.1f}
rated_torque_nm = {:.1f}
temperature_reference_c = 30.0
)",
                     name, published::kGearRatio, kFullVelocity, published::kRatedTorqueNm);
}

std::string motor_drive(std::string_view name, std::string_view torque_constant, std::string_view source) {
  return fmt::format(R"(format = "flexspline-model/1"
name = "{}"

[drive]
axis = "rotary"
gear_ratio = 1.0
torque_constant_nm_a = {{ value = {}, source = "{}" }}
rated_current_a = 3.5
rated_velocity_rad_s = 150.0
rated_torque_nm = 0.15
temperature_reference_c = 30.0
)",
                     name, torque_constant, source);
}

std::string sought(std::initializer_list<std::string_view> effects) {
  std::string text;
  for (const std::string_view effect : effects) text += fmt::format("\n[[effect]]\ntype = \"{}\"\n", effect);
  return text;
}

std::string known(std::string_view effect, std::string_view parameter, double value, std::string_view unit) {
  return fmt::format(
      "\n[[effect]]\ntype = \"{}\"\n[effect.parameters]\n{} = {{ value = {:.6e}, unit = \"{}\", fixed = true }}\n",
      effect, parameter, value, unit);
}

std::string square_root_damping() {
  return known("structural_damping", "exponent", published::kDampingExponent, "-");
}

std::string directional_friction() {
  return sought({"viscous_friction", "coulomb_friction", "viscous_asymmetry", "coulomb_asymmetry"});
}

std::string load_side() {
  return sought({"output_inertia", "output_viscous_friction", "output_coulomb_friction"});
}

std::string stribeck_of_known_velocity() {
  return known("stribeck_gaussian", "velocity", published::kTable8Velocity, "rad/s");
}

}  // namespace

std::string compliance_model() {
  return gear_drive("rhs-100-compliance") + sought({"linear_stiffness"}) + square_root_damping();
}

std::string cubic_compliance_model() {
  return gear_drive("rhs-100-cubic") + sought({"linear_stiffness", "cubic_stiffness"}) + square_root_damping();
}

std::string fast_friction_model() {
  return gear_drive("rhs-100-fast") + sought({"inertia"}) + directional_friction() + load_side();
}

std::string slow_friction_model() {
  const published::FrictionRow& row = published::kTable7Average;
  return gear_drive("rhs-100-slow") + known("inertia", "inertia", row.inertia, "kg*m^2") +
         known("viscous_friction", "coefficient", 0.5 * (row.viscous_positive + row.viscous_negative), "N*m*s/rad") +
         known("viscous_asymmetry", "coefficient", 0.5 * (row.viscous_positive - row.viscous_negative), "N*m*s/rad") +
         known("coulomb_friction", "torque", 0.5 * (row.coulomb_positive + row.coulomb_negative), "N*m") +
         known("coulomb_asymmetry", "torque", 0.5 * (row.coulomb_positive - row.coulomb_negative), "N*m") +
         stribeck_of_known_velocity();
}

std::string motor_model() {
  return motor_drive("dc-motor", "0.0543", "report, section 1.2") +
         known("inertia", "inertia", published::identified_motor().inertia, "kg*m^2") + directional_friction() +
         sought({"torque_constant_error"});
}

std::string simulated_motor_model() {
  return motor_drive("simulated-motor", "0.08", "a guess") +
         sought({"inertia", "viscous_friction", "coulomb_friction", "torque_constant_error"});
}

std::string simulated_stribeck_model() {
  return simulated_motor_model() + sought({"stribeck_hess_soom"});
}

std::string drive_model() {
  return gear_drive("rhs-100") + sought({"inertia"}) + directional_friction() + stribeck_of_known_velocity() +
         sought({"linear_stiffness"}) + square_root_damping() + load_side();
}

}  // namespace flexspline::rhs100
