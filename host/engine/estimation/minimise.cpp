#include "host/engine/estimation/minimise.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <exception>

namespace flexspline::estimation {
namespace {

class Cost final : public ceres::CostFunction {
 public:
  Cost(const Residuals& residuals, Eigen::Index count, std::size_t unknowns, const Minimisation& how)
      : residuals_(residuals), count_(count), unknowns_(unknowns), how_(how) {
    set_num_residuals(static_cast<int>(count));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(unknowns));
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    try {
      if (!failure_) return evaluate(parameters[0], residuals, jacobians);
    } catch (...) {  // not through the solver, which expects none
      failure_ = std::current_exception();
    }
    // Nothing is left to do: it ends at once, without a message on the terminal.
    std::fill_n(residuals, count_, 0.0);
    if (jacobians && jacobians[0]) std::fill_n(jacobians[0], count_ * static_cast<Eigen::Index>(unknowns_), 0.0);
    return true;
  }
  const std::exception_ptr& failure() const { return failure_; }

 private:
  bool evaluate(const double* parameters, double* residuals, double** jacobians) const {
    const std::vector<double> x(parameters, parameters + unknowns_);
    const bool wants_slopes = jacobians && jacobians[0];
    // The solver evaluates the points of its line search again: for the values, then for the slopes.
    if (x != at_ || (wants_slopes && slopes_.size() == 0)) {
      at_.clear();
      slopes_.resize(0, 0);
      if (!residuals_(x, values_, wants_slopes ? &slopes_ : nullptr)) return false;
      if (wants_slopes) hold_at_bounds(x);
      at_ = x;
    }
    Eigen::Map<Eigen::VectorXd>(residuals, count_) = values_;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    if (wants_slopes) Eigen::Map<RowMajor>(jacobians[0], count_, static_cast<Eigen::Index>(unknowns_)) = slopes_;
    return true;
  }
  // A parameter at a bound that would move beyond it stays there, and the step of the others is made without it: a step
  // that counted on it and was cut back after would be a poor one for them, too.
  void hold_at_bounds(const std::vector<double>& x) const {
    for (std::size_t j = 0; j < unknowns_; ++j) {
      const auto column = slopes_.col(static_cast<Eigen::Index>(j));
      const double slope = column.dot(values_);
      const bool low = j < how_.low.size() && x[j] <= how_.low[j], high = j < how_.high.size() && x[j] >= how_.high[j];
      if ((low && slope > 0.0) || (high && slope < 0.0)) slopes_.col(static_cast<Eigen::Index>(j)).setZero();
    }
  }

  mutable std::exception_ptr failure_;
  mutable std::vector<double> at_;
  mutable Eigen::VectorXd values_;
  mutable Eigen::MatrixXd slopes_;
  const Residuals& residuals_;
  Eigen::Index count_;
  std::size_t unknowns_;
  const Minimisation& how_;
};

}  // namespace

double minimise(std::vector<double>& x, Eigen::Index count, const Residuals& residuals, const Minimisation& how) {
  ceres::Problem problem;
  auto* const cost = new Cost(residuals, count, x.size(), how);  // the problem's from here on
  problem.AddResidualBlock(cost, nullptr, x.data());
  for (std::size_t j = 0; j < x.size(); ++j) {
    const int at = static_cast<int>(j);
    if (j < how.low.size() && std::isfinite(how.low[j])) problem.SetParameterLowerBound(x.data(), at, how.low[j]);
    if (j < how.high.size() && std::isfinite(how.high[j])) problem.SetParameterUpperBound(x.data(), at, how.high[j]);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = how.iterations;
  options.function_tolerance = how.function_tolerance;
  options.parameter_tolerance = how.parameter_tolerance;
  // By values alone: a line search with slopes would compute them at each point that it leaves.
  options.line_search_interpolation_type = ceres::QUADRATIC;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (cost->failure()) std::rethrow_exception(cost->failure());
  return summary.final_cost;
}

}  // namespace flexspline::estimation
