// A balance with its candidates by likelihood.
#pragma once

#include <memory>
#include <vector>

#include "host/engine/comparison/noise_floor.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/held_out.hpp"

namespace flexspline::selection {

struct SearchedBalance {
  BalanceSearch search;
  std::vector<CandidateFit> candidates;        // best first
  std::vector<comparison::NoiseFloor> floors;  // one each record
  comparison::NoiseFloor floor;                // of all; none where one record has none
  std::unique_ptr<HeldOut> held_out;           // of the motor's balance; null on others

  bool names_one() const { return !candidates.empty() && passes(candidates.front()); }
};

// Refuses candidates that would be named and that single records or held-out experiments contradict, or that are not
// worth a term, until the first one passes all of these checks. The list stays best first.
void check_first(SearchedBalance& balance);

}  // namespace flexspline::selection
