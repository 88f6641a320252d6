// Builds the catalogue entry of a formula; for user_defined_effect.cpp alone.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::catalogue {

// An entry with all that it points to.
struct UserDefinedEntry {
  model::Definition definition;
  std::vector<std::string> names, units;
  std::vector<effects::ParameterInfo> parameters;
  std::string equation;
  effects::Description info;
  Entry entry;
};

Balance balance_named(std::string_view name);

// The description of formulas.
extern const effects::Description kExpression;

// Which parameters only scale the torque: the largest set, by the order of the file, in which it is linear and with
// which it vanishes. Found by trying, as a formula may be anything. One for each parameter; zero for nonlinear ones.
std::vector<std::uint8_t> linear_in(const model::Effect& effect);

// Fills in the functions of `defined`. Throws FormulaError.
void make_formula(UserDefinedEntry& defined, const model::Effect& effect);

std::optional<model::Objection> objection_to_formula(const model::Effect& effect);

}  // namespace flexspline::catalogue
