#pragma once

#include <initializer_list>

#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::tests {

// Inertia, viscous and Coulomb friction of a rotary axis, without values: what most axes are first described by.
inline model::Model plain_model() {
  model::Model m;
  for (const char* name : {"inertia", "viscous_friction", "coulomb_friction"})
    m.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return m;
}

// The same with more effects.
inline model::Model plain_model_with(std::initializer_list<const char*> more) {
  model::Model m = plain_model();
  for (const char* name : more) m.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return m;
}

}  // namespace flexspline::tests
