// How the entry of a formula is made; for defined.cpp alone.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/catalogue/defined.hpp"

namespace flexspline::catalogue {

// An entry with all that it points to.
struct Made {
  model::Definition definition;
  std::vector<std::string> names, units;
  std::vector<effects::ParameterInfo> parameters;
  std::string equation;
  effects::Description info;
  Entry entry;
};

Balance balance_named(std::string_view name);

// What is said of formulas.
extern const effects::Description kExpression;

// Which parameters only scale the torque: the largest set, by the order of the file, in which it is linear and with
// which it vanishes. Found by trying, as a formula may be anything. One a parameter; nought for shapes.
std::vector<std::uint8_t> linear_in(const model::Effect& effect);

// Fills in what `made` computes. Throws FormulaError.
void make_formula(Made& made, const model::Effect& effect);

std::optional<model::Objection> objection_to_formula(const model::Effect& effect);

}  // namespace flexspline::catalogue
