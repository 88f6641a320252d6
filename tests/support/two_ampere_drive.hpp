// A drive of 2 A and 200 rad/s with four effects, for tests of what `pack` makes of its settings.
#pragma once

#include <string>
#include <utility>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::tests {

inline model::Model two_ampere_drive() {
  model::Model m;
  m.name = "some";
  m.drive.gear_ratio.value = 100.0;
  m.drive.torque_constant_nm_a.value = 0.05;
  m.drive.rated_current_a.value = 2.0;
  m.drive.rated_velocity_rad_s.value = 200.0;
  m.drive.rated_torque_nm.value = 40.0;
  for (const auto& [type, value] : {std::pair{"inertia", 1e-4},
                                    {"viscous_friction", 3.6e-4},
                                    {"linear_stiffness", 6300.0},
                                    {"output_inertia", 0.06}}) {
    model::Effect effect = catalogue::blank_effect(catalogue::get(type), m.drive.axis);
    effect.id = type;
    effect.parameters[0].value = value;
    m.effects.push_back(effect);
  }
  return m;
}

}  // namespace flexspline::tests
