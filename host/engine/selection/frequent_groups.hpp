// What stability selection found often enough to be reported: single terms, or groups that these data cannot
// distinguish.
#pragma once

#include <vector>

#include "host/engine/selection/stability_selection.hpp"

namespace flexspline::selection {

struct FoundTerm {
  std::vector<Frequency> group;  // the most frequent first; more than one: not distinguished
  double frequency = 0.0;        // of the subsamples that chose one of the group
  double share = 0.0;            // of the squares above the noise
  double least_by_mask = 1.0;    // frequency with reversals or without, the lesser one
  bool in_catalogue = true;      // else a curve or a placebo order does as well: an unknown structure
};

// Largest share first.
std::vector<FoundTerm> frequent_groups(const Stability& stability, const SelectionPolicy& policy);

// Terms of the catalogue, and groups, that are neither found nor ruled out: fewer subsamples chose them than must, and
// fewer did not than must. Most frequent first.
std::vector<FoundTerm> undecided(const Stability& stability, const std::vector<FoundTerm>& found,
                                 const SelectionPolicy& policy);

}  // namespace flexspline::selection
