// Nonlinear parameters: the range in which data can show them, and the search within it.
#pragma once

#include "host/engine/estimation/noise_covariance.hpp"
#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

// Bounds of a nonlinear parameter for the data at hand (see effects::Limit). `logarithmic` where it scales.
struct ParameterRange {
  double low = 0.0;
  double high = 1.0;
  bool logarithmic = false;
  // Position within the range, 0 to 1, and back.
  double at(double share) const;
  double share(double value) const;
};
ParameterRange parameter_range(const RegressionProblem& data, const Term& term, std::size_t parameter);

// Share of the range within which a parameter is at its end.
inline constexpr double kAtTheEnd = 0.005;
// Whether a parameter is a travel or a torsion that may be zero: the shortest that the data can show stands for any
// below it.
inline bool is_length(const effects::ParameterInfo& info) {
  return (info.limit == effects::Limit::torsion || info.limit == effects::Limit::travel) && info.low >= 0.0;
}

// Gives parameters of kind grid that the model does not state their values, from the largest torsion of the data.
void set_grid_values(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& which);

// Values to start from or to rank candidates on, spread over the range.
std::vector<double> parameter_grid(const ParameterRange& range, std::size_t count);

// Minimises the weighted residual over the free nonlinear parameters on this balance by variable projection (linear
// parameters are eliminated at each step; Jacobian after Kaufman), from the values in `terms`, within their ranges.
// Writes the result into `terms`. Returns the weighted sum of squares.
double refine_nonlinear(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& on_balance,
                        const NoiseCovariance& error_covariance);
// The same to a relative change of the sum below `tolerance`. Where `coarse`
// (RegressionProblem::decimated) is given, the search begins on that.
double refine_nonlinear(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& on_balance,
                        const NoiseCovariance& error_covariance, double tolerance,
                        const RegressionProblem* coarse = nullptr);

// Chooses starting values for nonlinear parameters that the model does not state: sweeps each over its grid, twice
// around; from the usual ones or the middle of their ranges, or from those that `terms` has, which stay where none is
// better.
enum class SweepFrom { usual, values };
void sweep_nonlinear(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& on_balance,
                     const NoiseCovariance& error_covariance, SweepFrom from = SweepFrom::usual);

}  // namespace flexspline::estimation
