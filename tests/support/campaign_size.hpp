// How much of a campaign is run: `./dev test` runs a part of what `./dev soak MINUTES campaigns` runs whole.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

namespace flexspline::tests {

inline bool whole_campaigns() {
  return std::getenv("FLEXSPLINE_WHOLE_CAMPAIGNS") != nullptr;
}

// Drives or seeds of a campaign.
template <class Number>
Number in_campaign(Number of_test, Number of_whole) {
  return whole_campaigns() ? of_whole : of_test;
}

// One case of `of`, from the case `first` on; or all. Tests that begin with another case share the cases between them.
inline std::vector<std::string> part_of(const std::vector<std::string>& all, std::size_t of = 2,
                                        std::size_t first = 0) {
  if (whole_campaigns()) return all;
  std::vector<std::string> part;
  for (std::size_t i = first; i < all.size(); i += of) part.push_back(all[i]);
  return part;
}

}  // namespace flexspline::tests
