#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hil/rhs100/experiments.hpp"

namespace flexspline::rhs100 {

/// The README.md that is written beside the data: what is the report's, and what is chosen.
std::string readme(const std::vector<Set>& sets, std::uint64_t seed);

}  // namespace flexspline::rhs100
