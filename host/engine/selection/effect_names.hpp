// Names of effects, and the candidates that bear them.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

inline NamedEffect name_of(const CandidateFit& candidate) {
  return {std::string(candidate.model.entry->name()), candidate.model.order};
}

inline NamedEffect name_of(const Candidate& candidate) {
  return {candidate.effect, candidate.order};
}

// "torque_ripple:2".
std::string label_of(const NamedEffect& name);

// Whether two names are one, or two laws of a family: resampling has the nonlinear parameters at fixed values only, and
// one law of presliding for all, so likelihood decides which law of the family it is.
bool is_of_family(const NamedEffect& a, const NamedEffect& b);
inline bool is_of_family(const NamedEffect& name, const CandidateFit& candidate) {
  return is_of_family(name, name_of(candidate));
}

inline bool contains(const std::vector<NamedEffect>& names, const NamedEffect& name) {
  return std::ranges::find(names, name) != names.end();
}

inline bool contains_family(const std::vector<NamedEffect>& names, const CandidateFit& candidate) {
  return std::ranges::any_of(names, [&](const NamedEffect& name) { return is_of_family(name, candidate); });
}

// The candidate of that name; null: there is none.
const CandidateFit* candidate_named(const SearchedBalance& balance, const NamedEffect& name);

}  // namespace flexspline::selection
