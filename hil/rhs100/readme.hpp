#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hil/rhs100/experiments.hpp"

namespace flexspline::rhs100 {

/// The README.md of the data set: which values are from the report, and which are chosen.
std::string readme(const std::vector<Set>& sets, std::uint64_t seed);

}  // namespace flexspline::rhs100
