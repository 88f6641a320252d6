#pragma once

#include <stdexcept>
#include <string>

namespace flexspline::deployment {

// Throws std::invalid_argument with `what`, where a motor's or a stage's numbers cannot be represented in its settings.
inline void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument(what);
}

}  // namespace flexspline::deployment
