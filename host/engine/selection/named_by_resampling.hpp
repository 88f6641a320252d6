// What is named of what resampling found on the motor's balance.
#pragma once

#include <string>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

inline NamedEffect name_of(const CandidateFit& candidate) {
  return {std::string(candidate.model.entry->name()), candidate.model.order};
}

// Whether two names are one, or two laws of a family: resampling has the nonlinear parameters at fixed values only, and
// one law of presliding for all, so likelihood decides which law of the family it is.
bool is_of_family(const NamedEffect& a, const NamedEffect& b);

// An error of the phase, of a filter or an elastic gear, makes of a wave what a law of friction over the angle is.
// Halves of the data take either for the other, so likelihood decides which it is, or that both are one group.
void take_likelier_waves(Resampling& resampling, const SearchedBalance& motor);

// Effects whose torques are one on these data, as a weight and a ripple once a turn are without a gear, are one group:
// halves choose the one that is visible at more bandwidths. They have the same likelihood.
void add_identical_effects(Resampling& resampling, const SearchedBalance& motor);

// Whether all data contradict what their halves chose: with it, the likelihood of the data left out of the fit falls
// significantly, and their error rises. The halves are parts of the same motions, and agree in what those have in
// common; then the held-out error has to fall by as much as an effect that matters. Presliding is not judged, as the
// likelihood leaves out reversals.
bool is_contradicted(const Resampling::FoundTerm& found, const SearchedBalance& motor);

// Whether the names that resampling found may be stated: most of all subsamples chose one, or the squared error on
// experiments that are held out falls by a term's share, or the likelihood of all data is significant for one. Where
// the model alone leaves known noise, many subsamples abstain and the others may have selected noise, so that their
// frequency does not count; but likelihood leaves out reversals, and cannot judge a state of presliding. For an effect
// of the output's angle the frequency does not count either, and the held-out error has to fall by half.
bool may_be_stated(const Resampling& resampling, const Resampling::FoundTerm& found, const SearchedBalance& motor);

// Whether an effect delays the current: it reads the current alone and has a state.
bool is_delay_of_current(const catalogue::Entry& entry);

// Whether the likeliest effect, which resampling cannot choose, takes off most of the squared error on data left out
// and a part that matters of that on held-out experiments, while halves find nothing else; or it is a delay of the
// current, and the effort leads the motion by a lag that explains most of what is above the noise, as it does of the
// squared error on held-out experiments.
bool stands_alone(const Resampling& resampling, const CandidateFit& first);

// Whether resampling decides the verdict on the motor's balance. Likelihood has more power where exactly one effect is
// missing: it decides where the halves of the data show nothing above the noise, and where resampling does not
// contradict it.
bool resampling_decides(const Resampling& resampling, const SearchedBalance& motor);

// The effects to name: single ones, or a group that these data cannot distinguish. Of a family of laws the one that
// fits all data best.
struct StableNames {
  std::vector<NamedEffect> names;
  bool is_group = false;
};
StableNames stable_names(const Resampling& resampling, const SearchedBalance& motor);
// Whether it names any effect.
bool names_any(const Resampling& resampling, const SearchedBalance& motor);

// Names the effects that resampling found in the catalogue, if any. Their candidates come first.
void name_stable(SearchedBalance& chosen, Diagnosis& result);

}  // namespace flexspline::selection
