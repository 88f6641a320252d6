// What is named of what resampling found on the motor's balance.
#pragma once

#include <optional>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// How often halves of the data chose an effect, or one of its family; nothing where they cannot: it has no linear
// parameter, or more nonlinear ones than one.
std::optional<double> support_of(const Resampling& resampling, const CandidateFit& candidate);

// The effects to name: single ones, or a group that these data cannot distinguish. Of a family of laws the one that
// fits all data best.
struct StableNames {
  std::vector<NamedEffect> names;
  bool is_group = false;
};
StableNames stable_names(const Resampling& resampling, const SearchedBalance& motor);
// Whether it names any effect.
bool names_any(const Resampling& resampling, const SearchedBalance& motor);

// Names the effects that resampling found in the catalogue and that keep the naming rules, if any. Their candidates
// come first.
void name_stable(SearchedBalance& chosen, Diagnosis& result);

}  // namespace flexspline::selection
