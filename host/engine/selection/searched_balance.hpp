// A balance with its candidates by likelihood.
#pragma once

#include <vector>

#include "host/engine/comparison/noise_floor.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/confounding.hpp"

namespace flexspline::selection {

struct SearchedBalance {
  BalanceSearch search;
  std::vector<CandidateFit> candidates;        // best first
  std::vector<comparison::NoiseFloor> floors;  // one each record
  comparison::NoiseFloor floor;                // of all; none where one record has none

  bool names_one() const { return !candidates.empty() && passes(candidates.front()); }
};

}  // namespace flexspline::selection
