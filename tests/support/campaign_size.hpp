// How much of a campaign is run: `./dev test` runs a part of what `./dev soak MINUTES campaigns` runs whole.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

namespace flexspline::testing {

inline bool whole_campaigns() {
  return std::getenv("FLEXSPLINE_WHOLE_CAMPAIGNS") != nullptr;
}

// Drives or seeds of a campaign.
template <class Number>
Number in_campaign(Number of_test, Number of_whole) {
  return whole_campaigns() ? of_whole : of_test;
}

// Every second case, or all.
inline std::vector<std::string> part_of(const std::vector<std::string>& all) {
  if (whole_campaigns()) return all;
  std::vector<std::string> part;
  for (std::size_t i = 0; i < all.size(); i += 2) part.push_back(all[i]);
  return part;
}

}  // namespace flexspline::testing
