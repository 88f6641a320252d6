// The published list of effects: what users, model files and parameter blocks rely on. Written from the list of effects
// itself, not from the headers that define them.
#pragma once

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::tests {

struct Published {
  struct Parameter {
    std::string_view name;
    std::string_view unit;
    catalogue::Kind kind;
    double usual;
    double usual_to;  // the end of a range, or as `usual`
  };
  std::string_view name;
  std::size_t id;  // in the parameter block: never changed, never given again
  catalogue::Balance balance;
  catalogue::Phase phase;
  std::vector<Parameter> parameters;
};

// Laws of many operators: their keys are counted, threshold_1 to threshold_8, and weight_jk with k up to j.
// Plays and relays lag behind the torsion: with a stiffness only negative weights lose energy.
inline std::vector<Published::Parameter> plays() {
  static const std::vector<std::string> kKeys = [] {
    std::vector<std::string> keys;
    for (const char* key : {"threshold_", "weight_"})
      for (int j = 1; j <= 8; ++j) keys.push_back(key + std::to_string(j));
    return keys;
  }();
  std::vector<Published::Parameter> parameters;
  for (const std::string& key : kKeys) {
    const bool threshold = key.starts_with("threshold");
    parameters.push_back({key, threshold ? "rad" : "N*m/rad",
                          threshold ? catalogue::Kind::grid : catalogue::Kind::linear, threshold ? 1e-6 : -2e3,
                          threshold ? 1e-2 : -10.0});
  }
  return parameters;
}
inline std::vector<Published::Parameter> relays() {
  static const std::vector<std::string> kKeys = [] {
    std::vector<std::string> keys;
    for (int j = 1; j <= 9; ++j)
      for (int k = 1; k <= j; ++k) keys.push_back("weight_" + std::to_string(j) + std::to_string(k));
    return keys;
  }();
  std::vector<Published::Parameter> parameters{{"span", "rad", catalogue::Kind::nonlinear, 1e-5, 1e-2}};
  for (const std::string& key : kKeys) parameters.push_back({key, "N*m", catalogue::Kind::linear, -1.0, -1e-3});
  return parameters;
}

inline const std::vector<Published>& published() {
  using enum catalogue::Balance;
  using enum catalogue::Phase;
  using enum catalogue::Kind;
  static const std::vector<Published> kList = {
      {"inertia", 1, motor, source, {{"inertia", "kg*m^2", linear, 1e-4, 1e-4}}},
      {"viscous_friction", 2, motor, source, {{"coefficient", "N*m*s/rad", linear, 3.6e-4, 3.6e-4}}},
      {"coulomb_friction", 3, motor, source, {{"torque", "N*m", linear, 0.045, 0.045}}},
      {"viscous_asymmetry", 4, motor, source, {{"coefficient", "N*m*s/rad", linear, 1e-5, 1e-4}}},
      {"coulomb_asymmetry", 5, motor, source, {{"torque", "N*m", linear, 1e-3, 6e-3}}},
      {"stribeck_gaussian",
       6,
       motor,
       source,
       {{"amplitude_positive", "N*m", linear, 0.012, 0.012},
        {"amplitude_negative", "N*m", linear, 0.012, 0.012},
        {"velocity", "rad/s", nonlinear, 3.0, 3.0}}},
      {"power_law_friction",
       7,
       motor,
       source,
       {{"torque", "N*m", linear, 0.02, 0.02}, {"exponent", "1", nonlinear, 0.4, 0.7}}},
      {"load_dependent_friction", 8, motor, source, {{"coefficient", "1", linear, 0.03, 0.08}}},
      {"temperature_viscous", 9, motor, modulate, {{"coefficient", "1/degC", nonlinear, 0.012, 0.012}}},
      {"dahl_friction",
       10,
       motor,
       source,
       {{"torque", "N*m", linear, 0.045, 0.045}, {"presliding", "rad", nonlinear, 0.05, 0.05}}},
      {"torque_ripple",
       11,
       motor,
       source,
       {{"order", "1", given, 2.0, 4.0}, {"cosine", "N*m", linear, 0.004, 0.004}, {"sine", "N*m", linear, 0.0, 0.004}}},
      {"current_offset", 12, motor, source, {{"current", "A", linear, 0.05, 0.05}}},
      {"torque_bias", 13, motor, source, {{"torque", "N*m", linear, 0.0, 0.045}}},  // no size published
      {"linear_stiffness", 14, transmission, source, {{"stiffness", "N*m/rad", linear, 6.3e3, 6.3e3}}},
      {"structural_damping",
       15,
       transmission,
       source,
       {{"torque", "N*m", linear, 57.0, 57.0}, {"exponent", "1", nonlinear, 0.5, 0.5}}},
      {"backlash", 16, transmission, shift, {{"half_width", "rad", nonlinear, 1.5e-4, 1.5e-4}}},
      {"output_inertia", 17, load, source, {{"inertia", "kg*m^2", linear, 0.06, 0.06}}},
      {"output_viscous_friction", 18, load, source, {{"coefficient", "N*m*s/rad", linear, 0.5, 0.5}}},
      {"output_coulomb_friction", 19, load, source, {{"torque", "N*m", linear, 0.6, 0.6}}},
      {"gravity", 20, load, source, {{"cosine", "N*m", linear, 0.0, 3.0}, {"sine", "N*m", linear, 3.0, 3.0}}},
      {"quadratic_drag", 21, motor, source, {{"coefficient", "N*m*s^2/rad^2", linear, 4e-7, 4e-7}}},
      {"stribeck_hess_soom",
       22,
       motor,
       source,
       {{"amplitude_positive", "N*m", linear, 0.012, 0.012},
        {"amplitude_negative", "N*m", linear, 0.012, 0.012},
        {"velocity", "rad/s", nonlinear, 3.0, 3.0}}},
      {"temperature_coulomb", 23, motor, modulate, {{"coefficient", "1/degC", nonlinear, 0.005, 0.005}}},
      {"lugre_friction",
       24,
       motor,
       source,
       {{"coulomb", "N*m", linear, 0.045, 0.045},
        {"static", "N*m", nonlinear, 0.055, 0.055},
        {"velocity", "rad/s", nonlinear, 3.0, 3.0},
        {"stiffness", "N*m/rad", nonlinear, 0.4, 0.4},
        {"damping", "N*m*s/rad", nonlinear, 1e-4, 1e-4}}},
      {"load_scaled_ripple",
       25,
       motor,
       source,
       {{"order", "1", given, 2.0, 2.0}, {"cosine", "1", linear, 5e-4, 5e-4}, {"sine", "1", linear, 0.0, 5e-4}}},
      {"torque_constant_error", 26, motor, source, {{"ratio", "1", linear, 0.2, 0.2}}},
      {"torque_constant_saturation", 27, motor, source, {{"coefficient", "1/A^2", linear, 5e-4, 1e-2}}},
      {"current_saturation", 28, motor, source, {{"limit", "A", nonlinear, 0.1, 100.0}}},
      {"current_delay", 29, motor, source, {{"delay", "s", nonlinear, 1e-3, 1e-3}}},
      {"quadratic_stiffness", 30, transmission, source, {{"stiffness", "N*m/rad^2", linear, 1e3, 1e7}}},
      {"cubic_stiffness", 31, transmission, source, {{"stiffness", "N*m/rad^3", linear, 3e8, 3e8}}},
      {"piecewise_stiffness",
       32,
       transmission,
       source,
       {{"stiffness_1", "N*m/rad", linear, 4725.0, 4725.0},
        {"stiffness_2", "N*m/rad", nonlinear, 6300.0, 6300.0},
        {"stiffness_3", "N*m/rad", nonlinear, 7875.0, 7875.0},
        {"torque_1", "N*m", nonlinear, 3.0, 3.0},
        {"torque_2", "N*m", nonlinear, 7.0, 7.0}}},
      {"dahl_hysteresis",
       33,
       transmission,
       source,
       {{"torque", "N*m", linear, 2.0, 2.0},
        {"stiffness", "N*m/rad", nonlinear, 5000.0, 5000.0},
        {"exponent", "1", nonlinear, 1.0, 1.0}}},
      {"modified_dahl_hysteresis",
       34,
       transmission,
       source,
       {{"torque", "N*m", linear, 0.1, 10.0}, {"stiffness", "N*m/rad", nonlinear, 1e2, 1e5}}},
      {"duhem_hysteresis",
       35,
       transmission,
       source,
       {{"rate", "1/rad", nonlinear, 1e2, 1e5},
        {"stiffness", "N*m/rad", linear, 1e3, 1e5},
        {"phi_0", "N*m", linear, 0.0, 1.0},
        {"phi_1", "N*m/rad", linear, 1e3, 1e5},
        {"phi_2", "N*m/rad^2", linear, 0.0, 1e7},
        {"phi_3", "N*m/rad^3", linear, 0.0, 1e9}}},
      {"bouc_wen_hysteresis",
       36,
       transmission,
       source,
       {{"stiffness", "N*m/rad", linear, 1e3, 1e5},
        {"beta", "1", nonlinear, 1e2, 1e5},
        {"gamma", "1", nonlinear, 0.0, 1e5},
        {"exponent", "1", nonlinear, 1.0, 3.0}}},
      {"prandtl_ishlinskii_hysteresis", 37, transmission, source, plays()},
      {"preisach_hysteresis", 38, transmission, source, relays()},
      {"torque_proportional_hysteresis",
       39,
       transmission,
       source,
       {{"torque", "N*m", linear, 0.5, 0.5},
        {"ratio", "1", nonlinear, 0.05, 0.05},
        {"stiffness", "N*m/rad", nonlinear, 1e2, 1e5}}},
      {"kinematic_error",
       40,
       transmission,
       shift,
       {{"order", "1", given, 2.0, 2.0},
        {"cosine", "rad", nonlinear, 4e-5, 4e-5},
        {"sine", "rad", nonlinear, 0.0, 4e-5}}},
      {"torque_offset", 41, transmission, source, {{"torque", "N*m", linear, 0.2, 0.2}}},
      {"torque_sensor_gain", 42, transmission, source, {{"ratio", "1", nonlinear, 0.03, 0.03}}},
      {"torque_sensor_ripple",
       43,
       transmission,
       source,
       {{"order", "1", given, 2.0, 2.0}, {"cosine", "N*m", linear, 0.3, 0.3}, {"sine", "N*m", linear, 0.0, 0.3}}},
      {"torsion_zero", 44, transmission, shift, {{"angle", "rad", nonlinear, 1e-4, 1e-4}}},
      // 45 is a table's.
      {"angle_dependent_friction",
       46,
       motor,
       source,
       {{"order", "1", given, 2.0, 2.0}, {"cosine", "N*m", linear, 0.006, 0.006}, {"sine", "N*m", linear, 0.0, 0.006}}},
      {"load_dependent_stiction",
       47,
       motor,
       source,
       {{"coefficient", "1", linear, 0.05, 0.05}, {"velocity", "rad/s", nonlinear, 3.0, 3.0}}},
      {"driving_dependent_loss",
       48,
       motor,
       source,
       {{"driving", "1", linear, 0.08, 0.08},
        {"driven", "1", linear, 0.04, 0.04},
        {"presliding", "rad", nonlinear, 0.05, 0.05}}},
  };
  return kList;
}

// Published as well, but made by users: no effects of the catalogue.
inline const std::set<std::string_view> kMadeByUsers = {"table_effect", "expression_effect"};

// What descriptions may refer to.
inline bool is_published(std::string_view name) {
  return kMadeByUsers.contains(name) ||
         std::any_of(published().begin(), published().end(), [&](const Published& p) { return p.name == name; });
}

}  // namespace flexspline::tests
