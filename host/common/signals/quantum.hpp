// The resolution of a quantised signal, from its values.
#pragma once

#include <optional>
#include <span>

namespace flexspline::signals {

/// Size of the smallest step; nothing where the steps are not multiples of one.
std::optional<double> quantum_of(std::span<const double> signal);

}  // namespace flexspline::signals
