// A law of presliding with its values from all samples of the motor's balance: the search by likelihood leaves out
// those around reversals, where alone it shows.
#pragma once

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// Fits and cross-validates a law of presliding that is named on the motor's balance with the reversals, with the other
// names in the model, and puts values, errors and evidence of that fit into the result. Nothing changes where none is
// named, where the options keep the reversals anyhow, or without that balance (null).
void refit_presliding(const data::Dataset& dataset, const model::Model& model, const Options& options,
                      const SearchedBalance* motor, Diagnosis& result);

}  // namespace flexspline::selection
