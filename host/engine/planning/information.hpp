// Information that records hold about models: R factors of the models' columns, small enough to add up records by the
// thousand.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::planning {

using estimation::RegressionProblem;
using estimation::Terms;

// A model with values for all parameters, and the columns that a fit of it may use.
struct Hypothesis {
  Terms terms;
  std::vector<std::size_t> columns;  // places in the layout
  std::size_t torque = 0;            // place of the torque of all its effects
  std::size_t known = 0;             // place of that of its known parameters
};

// Columns over any data, in one order, so that factors of different data add up.
class ColumnLayout {
 public:
  // Adds the columns of a model: its free linear parameters, the slopes by its free nonlinear parameters at their
  // values, and the delay. Columns that another model has as well are shared.
  Hypothesis add(Terms terms);
  std::size_t size() const { return columns_.size(); }
  // All columns over the samples of a balance, one each.
  Eigen::MatrixXd over(const RegressionProblem& data) const;

 private:
  struct Column {
    std::string label;
    std::function<Eigen::VectorXd(const RegressionProblem&)> make;
  };
  std::size_t place(std::string label, std::function<Eigen::VectorXd(const RegressionProblem&)> make);
  std::vector<Column> columns_;
};

// R factors of columns over each record of the data, by the index of the record among the prepared ones; an
// empty matrix where a record has no samples.
std::vector<Eigen::MatrixXd> factors(const RegressionProblem& data, const Eigen::MatrixXd& columns);
// The factor of the samples of all `factors` together. Empty ones are ignored.
Eigen::MatrixXd stacked_factor(const std::vector<const Eigen::MatrixXd*>& factors);

// Squares of the torque of `truth` that is orthogonal to the columns of `other`.
double unexplained(const Eigen::MatrixXd& factor, const Hypothesis& truth, const Hypothesis& other);

}  // namespace flexspline::planning
