// What an effect must score to be named.
#pragma once

namespace flexspline::diagnosis {

inline constexpr double kNamedScore = 20.0;

}  // namespace flexspline::diagnosis
