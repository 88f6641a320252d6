#pragma once

namespace flexspline {

// rad in a turn.
inline constexpr double kTurn = 6.283185307179586;

}  // namespace flexspline
