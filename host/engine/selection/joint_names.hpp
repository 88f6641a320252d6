// Several effects in one model: each name has to gain something while the others are in it.
#pragma once

#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

struct JointNames {
  std::vector<NamedEffect> names;       // what is left, with what replaces others
  std::vector<NamedEffect> eliminated;  // in the order in which they were taken off
  bool is_group = false;                // these data cannot distinguish the names
  std::vector<NamedEffect> more;        // where the names are a group: what else gains something
};

// Backward elimination (Miller, Subset Selection in Regression, 2002, section 3.4) of names that halves of the data
// chose one by one. The likeliest candidate is in the model as well, where it gains something with all names in it: a
// name that is not significant with it is encompassed by it (Mizon and Richard 1986), and it is named instead where
// halves chose it, or held-out experiments confirm it where there are any; where halves cannot judge it and the
// catalogue has both as confused, they are a group. Only names that likelihood sees alone are
// taken off; presliding is not tried, as likelihood leaves out the reversals where alone it shows.
JointNames eliminate_backward(const Resampling& resampling, const SearchedBalance& motor,
                              std::vector<NamedEffect> names);

}  // namespace flexspline::selection
