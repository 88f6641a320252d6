#include "host/engine/estimation/noise_covariance.hpp"

#include <Eigen/Core>
#include <cmath>
#include "host/common/algebra/decompositions.hpp"

namespace flexspline::estimation {

void NoiseCovariance::add_random_effects(const RowRange& rows, const Eigen::MatrixXd& columns) {
  const algebra::Eigenpairs eigen = algebra::eigenpairs(columns.transpose() * columns);
  Common common{rows, Eigen::MatrixXd::Zero(columns.rows(), columns.cols()), Eigen::VectorXd::Zero(columns.cols())};
  const double largest = eigen.values.maxCoeff();
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    const double square = eigen.values[k];
    if (!(square > 1e-12 * largest) || !(square > 0.0)) continue;
    common.basis.col(k) = columns * eigen.vectors.col(k) / std::sqrt(square);
    common.taken[k] = 1.0 - 1.0 / std::sqrt(1.0 + square);
  }
  common_.push_back(std::move(common));
}

void NoiseCovariance::remove_common(Eigen::MatrixXd& rows) const {
  for (const Common& c : common_) {
    auto part = rows.middleRows(c.rows.first, c.rows.size());
    part -= c.basis * (c.taken.asDiagonal() * (c.basis.transpose() * part)).eval();
  }
}

Eigen::MatrixXd NoiseCovariance::whiten(const Eigen::MatrixXd& samples) const {
  Eigen::MatrixXd white = root_weights_.asDiagonal() * samples;
  remove_common(white);
  if (root_counts_.size() > 0) white = root_counts_.asDiagonal() * white;
  return white;
}

NoiseCovariance NoiseCovariance::with_counts(const Eigen::VectorXd& root_counts) const {
  NoiseCovariance other = *this;
  other.root_counts_ = root_counts;
  return other;
}

Eigen::MatrixXd NoiseCovariance::score_columns(const Eigen::MatrixXd& rows) const {
  Eigen::MatrixXd white = whiten(rows);
  remove_common(white);
  return white;
}

NoiseCovariance noise_covariance(const RegressionProblem& data, const Eigen::VectorXd& root_weights,
                                 const Eigen::MatrixXd& torques, const Eigen::VectorXd& std,
                                 double autocorrelation_time) {
  NoiseCovariance error_covariance(root_weights);
  if (std.size() == 0 || std.maxCoeff() <= 0.0) return error_covariance;
  const Eigen::MatrixXd along = torques * std.asDiagonal() / std::sqrt(autocorrelation_time);
  for (const RowRange& range : data.records())
    error_covariance.add_random_effects(range, along.middleRows(range.first, range.size()));
  return error_covariance;
}

}  // namespace flexspline::estimation
