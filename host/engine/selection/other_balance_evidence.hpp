// Evidence of the other torque balances for an effect: many act on two of them, with the same parameters.
#pragma once

#include <vector>

#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// The searches among `all`, other than `own`, on whose balances the effect of a candidate acts as well.
std::vector<BalanceSearch*> other_balances_of(const std::vector<BalanceSearch*>& all, const BalanceSearch& own,
                                              const CandidateFit& candidate);

// For each admissible candidate of `own`, cross-validates its effect on every other balance that it acts on, with
// parameters on which both agree: a ripple of the torque sensor and an error of the gear have the same effect where the
// spring twists, but only the gear's error turns the motor. The scores go to `CandidateFit::other_balance_score`, what
// is refuted there is refused, and the candidates are put in order again. `all` holds the searches of every balance,
// `own` the one whose candidates these are.
void add_other_balance_evidence(const std::vector<BalanceSearch*>& all, BalanceSearch& own,
                                std::vector<CandidateFit>& candidates);

// Whether the effect of a candidate and the named one may be taken for each other, by the catalogue, with the same
// order if they have one.
bool is_confused_with(const CandidateModel& candidate, const catalogue::Entry& named, std::optional<double> order);

// Takes the evidence of other balances off a candidate of `own` without an order where a candidate of those, with which
// it may be confused, explains more there: an offset of the motor's current is no offset of the torque's sensor.
// Returns whether there was one; the list stays best first.
bool discount_evidence(const std::vector<SearchedBalance>& all, SearchedBalance& own);

}  // namespace flexspline::selection
