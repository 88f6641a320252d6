// Errors of the encoders, which no transmission test may take for a law of the gear.
#pragma once

#include <vector>

#include "host/engine/selection/candidate_fits.hpp"

namespace flexspline::selection {

// The torsion is a small difference of two angles, so an encoder's zero and its eccentric disc, some arc seconds once
// and twice per turn of the output, are seen in it on most machines, and over a short travel they resemble many laws.
// Where they lower the error significantly, each candidate without an order must do so with them in the model as well;
// else it is refused, unless it explains most of another balance, too. Of those that remain the best with them comes
// first. `own`: the search on the transmission, whose candidates these are; nothing changes on other balances. The list
// stays best first.
void check_encoder_errors(const BalanceSearch& own, std::vector<CandidateFit>& candidates);

}  // namespace flexspline::selection
