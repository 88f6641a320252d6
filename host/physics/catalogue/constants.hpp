// From a model's description of its drive to what effects derive their coefficients from.
#pragma once

#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/model/known_effects.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::catalogue {

// SI on the host: all bases are one. What the model does not state takes the value that changes nothing (gear ratio and
// torque constant one, 30 degC); the rated velocity falls back to 1 rad/s, which only moves the scale of a power law.
DriveConstants<double> constants_of(const model::Drive& drive);

// "N*m*s/rad" or "N*s/m".
std::string_view unit_on(const effects::Unit& unit, data::Axis axis);

// The catalogue as the reader of model files asks for it.
const model::KnownEffects& known_effects();

// A parameter vector in the order of the catalogue; zero where the model has no value.
std::vector<double> values_of(const model::Effect& effect, const Entry& entry);

// A new effect for a model: all parameters of the catalogue with their units and no values.
model::Effect blank_effect(const Entry& entry, data::Axis axis);

}  // namespace flexspline::catalogue
