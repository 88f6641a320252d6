// What no effect of the catalogue explains: over which signal, with which curve, and what to record next.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/engine/estimation/learned_table.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::selection {

struct Diagnosis;
struct BalanceSearch;
struct CandidateFit;

struct UnknownStructure {
  // A curve over one signal, learnt together with the model on the balance of the diagnosis. What it was learnt on is
  // the effect that `flexspline add` takes: "table_effect:velocity*direction".
  std::string effect;
  model::Definition definition;  // variable, balance, direction, and the table
  estimation::LearnedTable curve;
  // All signals over which a curve explains something, best first: those that come close go along with the best one in
  // these motions.
  struct DependentVariable {
    std::string variable;           // "velocity", "torque*direction"
    double decrease_percent = 0.0;  // of squares of samples left out of the fit
  };
  std::vector<DependentVariable> depends_on;
  // What the named effect explains of what it and the curve explain together; nothing where no effect was named.
  std::optional<double> named_share_percent;
  std::string record_next;
};

// Learns curves on what `model` leaves; over the torque only where its sensor has no noise. Nothing where none predicts
// left-out samples better by more than chance would.
std::optional<UnknownStructure> find_unknown_structure(BalanceSearch& search, const estimation::Terms& model,
                                                       bool torque_has_noise);

// Whether what is missing is outside the catalogue. `named` is the candidate that would be named, or null
// where none is. Where a curve explains what no effect does, or a named one explains less than nine tenths of it and no
// second one the rest, the verdict becomes unknown_structure and nothing is named.
void check_unknown_structure(BalanceSearch& search, const CandidateFit* named, Diagnosis& result);

}  // namespace flexspline::selection
