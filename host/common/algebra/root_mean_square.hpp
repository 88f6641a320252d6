#pragma once

#include <Eigen/Core>
#include <cmath>

namespace flexspline::algebra {

// sqrt(x'x / n); zero without elements.
inline double root_mean_square(const Eigen::Ref<const Eigen::VectorXd>& x) {
  return x.size() > 0 ? std::sqrt(x.squaredNorm() / static_cast<double>(x.size())) : 0.0;
}

}  // namespace flexspline::algebra
