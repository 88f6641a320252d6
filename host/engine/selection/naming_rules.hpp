// The rules that an effect which halves of the data found must keep, so that it is named.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// An effect that halves of the data found on the motor's balance, or a group that they cannot distinguish.
struct FoundOnMotor {
  const Resampling::FoundTerm& found;
  const Resampling& resampling;
  const SearchedBalance& motor;
  const std::vector<NamedEffect>& named_before;  // with a larger share of the error
  bool is_behind_group = false;                  // these data cannot distinguish those named before
};

struct NamingRule {
  std::string_view name;
  bool (*is_kept)(const FoundOnMotor&);
  std::string (*why_not)(const FoundOnMotor&);  // what to tell the user where it is not kept
};

// In the order in which they are tried: the first that is not kept is the reason why the effect is not named.
std::span<const NamingRule> naming_rules();

// The first rule that is not kept; null: the effect is named.
const NamingRule* broken_rule(const FoundOnMotor& effect);

// "the error on experiments that are held out rises by ...".
std::string held_out_rise(const Resampling::FoundTerm& found);

// Whether all data contradict what their halves chose: with it, the likelihood of the data left out of the fit falls
// significantly, and their error rises. The halves are parts of the same motions, and agree in what those have in
// common; then the held-out error has to fall by as much as an effect that matters. Presliding is not tried, as the
// likelihood leaves out reversals.
bool is_contradicted(const Resampling::FoundTerm& found, const SearchedBalance& motor);

// Whether the names that resampling found may be stated: most of all subsamples chose one, or the squared error on
// experiments that are held out falls by a term's share, or the likelihood of all data is significant for one. Where
// the model alone leaves known noise, many subsamples abstain and the others may have selected noise, so that their
// frequency does not count; but likelihood leaves out reversals, and cannot judge a state of presliding. For an effect
// of the output's angle, or a group with one, the frequency does not count either, and the held-out error has to fall
// by half.
bool may_be_stated(const Resampling& resampling, const Resampling::FoundTerm& found, const SearchedBalance& motor);

}  // namespace flexspline::selection
