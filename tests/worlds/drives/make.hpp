#pragma once

#include <cstdint>
#include <vector>

#include "tests/worlds/drives/draw.hpp"
#include "tests/worlds/drives/measure.hpp"
#include "tests/worlds/drives/truth.hpp"

namespace flexspline::worlds::drives {

/// A case with its records and its truth.
struct Made {
  Case drive;
  std::vector<Measured> records;
  Truth truth;
};

/// Draws machines of this kind until the controller holds all motions and the hidden effect raises the error by 3 % or
/// more. The same seed gives the same numbers. Throws if 200 machines are not enough.
Made make_case(const Kind& kind, std::uint64_t seed);

}  // namespace flexspline::worlds::drives
