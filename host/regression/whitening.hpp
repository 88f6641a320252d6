// What makes the errors of a regression alike and independent: a weight for each row, and what a record's errors have
// in common taken down to the size of the rest.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "host/regression/balance_data.hpp"

namespace flexspline::regression {

// Errors of a record with covariance W^-1/2 (I + B B') W^-1/2, W the weights and B columns along which they vary
// together, are made white by (I + B B')^-1/2 W^1/2.
class Whitening {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): weights alone are the usual case
  Whitening(Eigen::VectorXd root_weights) : root_weights_(std::move(root_weights)) {}

  // The record's rows vary along `columns` of their weighted values, each by one standard deviation of the noise.
  void vary(const RowRange& rows, const Eigen::MatrixXd& columns);

  // No record's errors have anything in common.
  bool weights_only() const { return common_.empty() && root_counts_.size() == 0; }
  const Eigen::VectorXd& root_weights() const { return root_weights_; }

  // `rows` (one for each row of the data), made white.
  Eigen::MatrixXd operator*(const Eigen::MatrixXd& rows) const;
  // (I + B B')^-1 W^1/2 times `rows`: what generalised least squares multiplies weighted errors by.
  Eigen::MatrixXd twice(const Eigen::MatrixXd& rows) const;

  // The same with every white row counted so many times; `root_counts` are the roots, one a row.
  Whitening counted(const Eigen::VectorXd& root_counts) const;

 private:
  struct Common {
    RowRange rows;
    Eigen::MatrixXd basis;  // orthonormal
    Eigen::VectorXd taken;  // share of each that is taken off
  };
  void take_off_common(Eigen::MatrixXd& rows) const;

  Eigen::VectorXd root_weights_;
  Eigen::VectorXd root_counts_;  // none: each row once
  std::vector<Common> common_;
};

}  // namespace flexspline::regression
