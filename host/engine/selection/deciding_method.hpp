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

// Whether the likeliest effect, which resampling cannot choose, takes off most of the squared error on data left out
// and a part that matters of that on held-out experiments, while halves find nothing else; or it is a delay of the
// current, and the effort leads the motion by a lag that explains most of what is above the noise, as it does of the
// squared error on held-out experiments, or, where there are none, the delay takes off a part that matters on data left
// out.
bool stands_alone(const Resampling& resampling, const CandidateFit& likeliest);

}  // namespace flexspline::selection
