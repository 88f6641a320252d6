// Dual numbers in one direction: a value and its derivative by one parameter, for Jacobians.
#pragma once

#include <ceres/jet.h>

#include "host/common/numbers/real.hpp"

namespace flexspline::numbers {

using Jet = ceres::Jet<double, 1>;

struct Dual : ScalarSystem<Jet> {
  // At zero the slope of |x|^d is unbounded for d < 1; a slope of zero there leaves a solver free to move on.
  static Jet pow_abs(const Jet& x, const Jet& exponent) {
    const double size = std::abs(x.a);
    if (size < 1e-12) return Jet(exponent.a > 0.0 ? 0.0 : 1.0);
    const double power = std::pow(size, exponent.a);
    Jet y(power);
    y.v = power * (exponent.a / x.a * x.v + std::log(size) * exponent.v);
    return y;
  }
};

}  // namespace flexspline::numbers
