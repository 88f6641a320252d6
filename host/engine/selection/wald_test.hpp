// Wald's test: whether the values of an effect differ from zero.
#pragma once

#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

// Probability that chance alone gives values of a linear effect so far from zero: chi-square of all, taken as
// independent; of a wave times the number of usual orders (Bonferroni). Nothing for a law with nonlinear parameters,
// which are no parameters where the effect is zero (Davies, 1977), and where no interval is known.
std::optional<double> wald_p_value(const Candidate& candidate);

// Whether the 95 % interval of a travel of presliding holds zero: dry friction alone, of an axis that sticks between
// its moves, has such a travel.
bool has_unresolved_travel(const Candidate& candidate);

// Takes back the names of linear effects whose values do not differ from zero, and of presliding of unresolved travel;
// a confounded group, of which each may stand in the place of another, only where none of them does.
void take_back_insignificant(Diagnosis& result);

// Whether resampling decided and experiments that are held out confirm a name.
bool is_confirmed_by_held_out(const Diagnosis& result, const NamedEffect& name);

}  // namespace flexspline::selection
