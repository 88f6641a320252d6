#include "host/engine/estimation/least_squares.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/common/algebra/decompositions.hpp"
#include "host/common/signals/autocorrelation.hpp"

namespace flexspline::estimation {

namespace {

// Parameters and covariance of the columns that were kept, which were scaled to length one.
void put(LinearFit& fit, const std::vector<Eigen::Index>& kept, const Eigen::VectorXd& length,
         const Eigen::VectorXd& solution, const Eigen::MatrixXd& covariance) {
  const auto count = static_cast<Eigen::Index>(kept.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index to = kept[static_cast<std::size_t>(i)];
    fit.theta[to] = solution[i] / length[to];
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::Index other = kept[static_cast<std::size_t>(j)];
      fit.unit_covariance(to, other) = covariance(i, j) / (length[to] * length[other]);
    }
  }
}

}  // namespace

LinearFit least_squares(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Eigen::VectorXd& root_weights) {
  const Eigen::Index columns = X.cols();
  LinearFit fit;
  fit.theta = Eigen::VectorXd::Zero(columns);
  fit.residual = y;
  fit.root_tolerance = Eigen::VectorXd::Zero(columns);
  fit.root_tolerance_of_all = Eigen::VectorXd::Zero(columns);
  fit.unit_covariance = Eigen::MatrixXd::Constant(columns, columns, 0.0);
  fit.unit_covariance.diagonal().setConstant(std::numeric_limits<double>::infinity());
  if (columns == 0 || X.rows() == 0) return fit;

  Eigen::MatrixXd scaled = root_weights.asDiagonal() * X;
  const Eigen::VectorXd length = scaled.colwise().norm();
  std::vector<Eigen::Index> kept;
  for (Eigen::Index j = 0; j < columns; ++j)
    if (length[j] > 0.0 && std::isfinite(length[j])) kept.push_back(j);
  // Removes one column at a time, the one with the smallest tolerance, until all others are determined.
  for (;;) {
    const auto count = static_cast<Eigen::Index>(kept.size());
    if (count == 0 || X.rows() < count) return fit;
    Eigen::MatrixXd A(X.rows(), count);
    for (Eigen::Index j = 0; j < count; ++j)
      A.col(j) = scaled.col(kept[static_cast<std::size_t>(j)]) / length[kept[static_cast<std::size_t>(j)]];
    const algebra::HouseholderQr qr(A);
    const auto [u, s, v] = algebra::singular_values(qr.r());
    const double smallest = std::max(s[count - 1], 1e-14 * s[0]);
    // Rows of R^-1 have length one over the tolerance of their column.
    Eigen::MatrixXd inverse_rows = v;
    for (Eigen::Index j = 0; j < count; ++j) inverse_rows.col(j) /= std::max(s[j], 1e-14 * s[0]);
    const Eigen::VectorXd own = inverse_rows.rowwise().norm().cwiseInverse();
    Eigen::Index worst = 0;
    own.minCoeff(&worst);
    for (Eigen::Index j = 0; j < count; ++j) fit.root_tolerance[kept[static_cast<std::size_t>(j)]] = own[j];
    if (fit.root_tolerance_of_all.isZero(0.0)) fit.root_tolerance_of_all = fit.root_tolerance;
    if (own[worst] < kUndetermined) {
      // Of collinear columns the last one is dropped: models list the basic effects first.
      Eigen::Index out = worst;
      for (Eigen::Index j = 0; j < count; ++j)
        if (own[j] < 3.0 * own[worst]) out = j;
      fit.root_tolerance[kept[static_cast<std::size_t>(out)]] = own[worst];
      kept.erase(kept.begin() + out);
      continue;
    }
    const Eigen::VectorXd weighted_y = root_weights.cwiseProduct(y);
    const Eigen::VectorXd solution = qr.solve(weighted_y);
    const Eigen::MatrixXd inverse = inverse_rows * u.transpose();
    const Eigen::MatrixXd covariance = inverse * inverse.transpose();
    put(fit, kept, length, solution, covariance);
    fit.condition_number = s[0] / smallest;
    fit.residual = y - X * fit.theta;
    return fit;
  }
}

LinearFit generalised_least_squares(const Eigen::MatrixXd& X, const Eigen::VectorXd& y,
                                    const NoiseCovariance& error_covariance) {
  if (error_covariance.is_diagonal()) return least_squares(X, y, error_covariance.root_weights());
  LinearFit fit =
      least_squares(error_covariance.whiten(X), error_covariance.whiten(y).col(0), Eigen::VectorXd::Ones(y.size()));
  fit.residual = y - X * fit.theta;
  return fit;
}

Eigen::VectorXd root_record_weights(const std::vector<RowRange>& records, const Eigen::VectorXd& residual) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(residual.size());
  std::vector<double> noise;
  for (const RowRange& range : records)
    noise.push_back(
        std::sqrt(residual.segment(range.first, range.size()).squaredNorm() / static_cast<double>(range.size())));
  if (noise.empty()) return weights;
  std::vector<double> sorted = noise;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double median = sorted[sorted.size() / 2];
  if (!(median > 0.0)) return weights;
  for (std::size_t i = 0; i < records.size(); ++i)
    weights.segment(records[i].first, records[i].size()).setConstant(1.0 / std::max(noise[i], 0.1 * median));
  return weights;
}

Eigen::Index newey_west_lags(double autocorrelation_time, Eigen::Index rows) {
  return std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::lround(6.0 * autocorrelation_time)), 12,
                                  std::max<Eigen::Index>(12, rows / 10));
}

Eigen::MatrixXd newey_west(const std::vector<RowRange>& records, const Eigen::MatrixXd& columns,
                           const Eigen::VectorXd& residual, Eigen::Index lags) {
  const Eigen::MatrixXd scores = residual.asDiagonal() * columns;
  Eigen::MatrixXd middle = scores.transpose() * scores;
  for (const RowRange& range : records) {
    // Neighbours are summed with their weights first: one product of matrices for all lags.
    const auto own = scores.middleRows(range.first, range.size());
    Eigen::MatrixXd later = Eigen::MatrixXd::Zero(own.rows(), own.cols());
    for (Eigen::Index lag = 1; lag <= std::min(lags, range.size() - 1); ++lag) {
      const double weight = 1.0 - static_cast<double>(lag) / static_cast<double>(lags + 1);
      later.topRows(own.rows() - lag) += weight * own.bottomRows(own.rows() - lag);
    }
    const Eigen::MatrixXd product = own.transpose() * later;
    middle += product + product.transpose();
  }
  return middle;
}

double autocorrelation_time(const std::vector<RowRange>& records, const Eigen::VectorXd& weighted_residual) {
  std::vector<std::span<const double>> parts;
  std::size_t longest = 0;
  for (const RowRange& range : records) {
    parts.emplace_back(weighted_residual.data() + range.first, static_cast<std::size_t>(range.size()));
    longest = std::max(longest, parts.back().size());
  }
  if (parts.empty()) return 1.0;
  return signals::integrated_autocorrelation_time(parts, std::max<std::size_t>(1, longest / 4));
}

double autocorrelation_time(const RegressionProblem& data, const Eigen::VectorXd& weighted_residual) {
  return std::max(autocorrelation_time(data.records(), weighted_residual), data.filter_autocorrelation_time());
}

}  // namespace flexspline::estimation
