// Which of two methods decides what the motor's balance lacks: stability selection on halves of the data, or the
// likelihood of all data.
#pragma once

#include <span>
#include <string_view>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

enum class Method { likelihood, resampling };

// What both methods found on the motor's balance.
struct BothMethods {
  const Resampling& resampling;
  const SearchedBalance& motor;
};

struct DecidingRule {
  std::string_view name;
  bool (*applies)(const BothMethods&);
  Method decides;
};

// In the order in which they are tried: the first that applies decides. Likelihood has more power where exactly one
// effect is missing: it decides where the halves of the data show nothing above the noise, and where they do not
// contradict it.
std::span<const DecidingRule> deciding_rules();

Method deciding_method(const Resampling& resampling, const SearchedBalance& motor);

// Whether the likeliest effect, which resampling cannot choose, takes off most of the squared error on data left out,
// while halves find nothing else; and a part that matters of that on held-out experiments, or, where none
// are held out or they cannot show it (a limit that they do not reach), no other effect explains any part of the error.
// Needs one candidate or more, best first.
bool stands_alone(const Resampling& resampling, std::span<const CandidateFit> candidates);

}  // namespace flexspline::selection
