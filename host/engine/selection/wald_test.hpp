// Wald's test: whether the values of an effect differ from zero.
#pragma once

#include <string>
#include <string_view>

#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

// Probability that chance alone gives values of a linear effect so far from zero: chi-square of all, taken as
// independent; of a wave times the number of usual orders (Bonferroni). Nothing for a law with nonlinear parameters,
// which are no parameters where the effect is zero (Davies, 1977), and where no interval is known.
std::optional<double> wald_p_value(const Candidate& candidate);

inline constexpr std::string_view kUnresolvedTravel =
    "the travel of presliding is too short for these samples to be distinguished from an axis that sticks at each "
    "reversal";
// Why a law of presliding is not certain, empty where it is: what all samples say against it
// (Candidate::presliding_doubt), or, where they were not asked, a 95 % interval of its travel that holds zero: dry
// friction alone, of an axis that sticks between its moves, has such a travel.
std::string doubt_about_presliding(const Candidate& candidate);

// Takes back the names of linear effects whose values do not differ from zero, and of presliding that is not certain;
// a confounded group, of which each may stand in the place of another, only where none of them does. Presliding is
// judged where `presliding` is set.
void take_back_insignificant(Diagnosis& result, bool presliding = true);

// Writes why a name was taken back into its candidate, and, where halves of the data decide, among what is possible.
void note_taken_back(Diagnosis& result, const NamedEffect& name, const std::string& why);

// Whether resampling decided and experiments that are held out confirm a name.
bool is_confirmed_by_held_out(const Diagnosis& result, const NamedEffect& name);

}  // namespace flexspline::selection
