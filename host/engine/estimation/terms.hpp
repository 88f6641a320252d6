// A model as regression sees it: effects with unknown and known parameters.
#pragma once

#include <string>
#include <vector>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::estimation {

using catalogue::Balance;

// One effect of the model.
struct Term {
  const catalogue::Entry* entry = nullptr;
  std::string id;
  std::vector<double> values;        // in the order of the catalogue, reduced (see effects::ParameterInfo)
  std::vector<std::uint8_t> known;   // fixed by the user, or given; else estimated
  std::vector<std::uint8_t> stated;  // has a value in the model, which is where a search starts

  bool adds_torque() const { return entry->adds_torque(); }
  // Adds a torque that no linear parameter scales.
  bool scaled_by_none() const { return adds_torque() && entry->count(effects::Kind::linear) == 0; }
  bool free_linear(std::size_t p) const { return !known[p] && entry->parameters[p].kind == effects::Kind::linear; }
  bool free_nonlinear(std::size_t p) const {
    return !known[p] && entry->parameters[p].kind == effects::Kind::nonlinear;
  }
  // Its name with the order, where it has one: "torque_ripple:7".
  std::string label() const;
};

// A parameter of a term.
struct ParameterRef {
  std::size_t term = 0;
  std::size_t parameter = 0;
  bool operator==(const ParameterRef&) const = default;
};

using Terms = std::vector<Term>;

// Whether a shift or modulation changes what the torque of a term is made of.
bool changes_inputs_of(const Term& changer, const Term& term);

inline std::vector<std::vector<double>> values_of_all(const Terms& terms) {
  std::vector<std::vector<double>> values;
  for (const Term& term : terms) values.push_back(term.values);
  return values;
}

Term term_of(const model::Effect& effect);
// A candidate: an effect of the catalogue with nothing known but the order, where it has one.
Term candidate_term(const catalogue::Entry& entry, std::optional<double> order = std::nullopt);
Terms terms_of(const model::Model& model);

std::vector<ParameterRef> free_linear_parameters(const Terms& terms, const std::vector<std::size_t>& which);
std::vector<ParameterRef> free_nonlinear_parameters(const Terms& terms, const std::vector<std::size_t>& which);

// What is measured at the gear's output, in any record.
struct OutputSignals {
  bool torque = false;
  bool torsion = false;  // with a torque: only then there is a transmission balance
};

// The balance on which the parameters of an effect are identified. In a drive without a torque sensor the motor balance
// holds the load's (and, in locked load, the transmission's) terms too. Without a torsion the errors of a torque sensor
// show on the motor balance alone.
Balance identified_on(const catalogue::Entry& entry, const OutputSignals& signals);
// Terms of a model whose parameters are identified on a balance.
std::vector<std::size_t> terms_on(const Terms& terms, Balance balance, const OutputSignals& signals);
// Terms that add to a balance although their parameters are identified on another one.
std::vector<std::size_t> terms_acting_on_other_balance(const Terms& terms, Balance balance,
                                                       const OutputSignals& signals);

}  // namespace flexspline::estimation
