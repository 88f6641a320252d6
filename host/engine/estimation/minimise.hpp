// Nonlinear least squares within bounds: the one place that knows the solver.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace flexspline::estimation {

// Fills the residuals at `x` and, where `slopes` is not null, their slopes (a row for each residual, a column for each
// unknown). False: `x` is a step too far, and the solver tries a shorter one.
using Residuals =
    std::function<bool(const std::vector<double>& x, Eigen::VectorXd& residuals, Eigen::MatrixXd* slopes)>;

struct Minimisation {
  std::vector<double> low, high;  // bounds of each unknown; infinite or empty: none
  int iterations = 60;
  double function_tolerance = 1e-6;
  double parameter_tolerance = 1e-6;
};

// Moves `x` to where the sum of squares of `count` residuals is least nearby (Levenberg and Marquardt). Returns half of
// that sum. Throws what `residuals` throws.
double minimise(std::vector<double>& x, Eigen::Index count, const Residuals& residuals, const Minimisation& how);

}  // namespace flexspline::estimation
