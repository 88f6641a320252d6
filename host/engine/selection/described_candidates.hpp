// The candidates of a diagnosis, as the user reads of them.
#pragma once

#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// A candidate of a balance with its values and errors.
Candidate candidate_of(const CandidateFit& candidate, const BalanceSearch& search, data::Axis axis);

// Puts a standard error and its 95 % interval, within the parameter's bounds, into an estimate.
void set_std(estimation::Estimate& e, double std, const effects::ParameterInfo& info);

// Adds the candidates of all balances to the result, admissible ones first and by their score, each with the smallest
// size that would be named, and what of the model it cannot be distinguished from.
void list_candidates(std::vector<SearchedBalance>& all, data::Axis axis, Diagnosis& result);

// Adds what on this drive makes the orders of candidates.
void explain_orders(const model::Drive& drive, Diagnosis& result);

}  // namespace flexspline::selection
