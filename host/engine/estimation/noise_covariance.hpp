// Covariance of the errors of a regression: a variance for each sample, and random effects that a record's samples have
// in common. Whitens samples for generalised least squares.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

// Errors of a record with covariance W^-1/2 (I + B B') W^-1/2, W the weights and B columns along which they vary
// together, are made white by (I + B B')^-1/2 W^1/2.
class NoiseCovariance {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): weights alone are the usual case
  NoiseCovariance(Eigen::VectorXd root_weights) : root_weights_(std::move(root_weights)) {}

  // The record's samples vary along `columns` of their weighted values, each by one standard deviation of the noise.
  void add_random_effects(const RowRange& rows, const Eigen::MatrixXd& columns);

  // No record's errors have anything in common.
  bool is_diagonal() const { return common_.empty() && root_counts_.size() == 0; }
  const Eigen::VectorXd& root_weights() const { return root_weights_; }

  // Sigma^(-1/2) times `samples` (one row for each sample of the data), Sigma this covariance.
  Eigen::MatrixXd whiten(const Eigen::MatrixXd& samples) const;
  // (I + B B')^-1 W^1/2 times `rows`: what generalised least squares multiplies weighted errors by.
  Eigen::MatrixXd score_columns(const Eigen::MatrixXd& rows) const;

  // The same with every white sample counted so many times; `root_counts` are the roots, one a sample.
  NoiseCovariance with_counts(const Eigen::VectorXd& root_counts) const;

 private:
  struct Common {
    RowRange rows;
    Eigen::MatrixXd basis;  // orthonormal
    Eigen::VectorXd taken;  // share of each that is taken off
  };
  void remove_common(Eigen::MatrixXd& rows) const;

  Eigen::VectorXd root_weights_;
  Eigen::VectorXd root_counts_;  // none: each sample once
  std::vector<Common> common_;
};

// Errors of samples at these weights that records have in common by their own friction: `torques` (weighted, a column a
// group) vary by `std`, noise of which `autocorrelation_time` samples count as one by one.
NoiseCovariance noise_covariance(const RegressionProblem& data, const Eigen::VectorXd& root_weights,
                                 const Eigen::MatrixXd& torques, const Eigen::VectorXd& std,
                                 double autocorrelation_time);

}  // namespace flexspline::estimation
