#include "host/selection/meta_regression.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace flexspline::selection {
namespace {

Eigen::MatrixXd centred(const Eigen::MatrixXd& rows) {
  return rows.rowwise() - rows.colwise().mean();
}

double sum_of_logarithms(const Eigen::VectorXd& variance) {
  return variance.array().log().sum();
}

}  // namespace

// Alternates between the coefficient, by weighted least squares, and the variances, by what is left.
MetaRegression meta_regression(const Eigen::MatrixXd& theta, const Eigen::MatrixXd& added) {
  const auto records = static_cast<double>(theta.rows()), parameters = static_cast<double>(theta.cols());
  const Eigen::MatrixXd e = centred(theta), q = centred(added);
  const Eigen::VectorXd ee = e.colwise().squaredNorm(), qq = q.colwise().squaredNorm(),
                        eq = e.cwiseProduct(q).colwise().sum();
  MetaRegression result;
  result.mean = theta.colwise().mean().transpose();
  if (!(qq.maxCoeff() > 0.0) || !(ee.minCoeff() > 0.0)) return result;
  Eigen::VectorXd variance = ee / records;
  constexpr int kRounds = 50;
  constexpr double kSame = 1e-10;
  for (int round = 0; round < kRounds; ++round) {
    const double information = qq.cwiseQuotient(variance).sum();
    const double next = eq.cwiseQuotient(variance).sum() / information;
    const double moved = std::abs(next - result.coefficient);
    result.coefficient = next;
    result.coefficient_std = 1.0 / std::sqrt(information);
    variance = ((ee - 2.0 * next * eq + next * next * qq) / records).cwiseMax(1e-12 * ee / records);
    if (moved <= kSame * std::abs(next)) break;
  }
  const double log_ratio = sum_of_logarithms(ee / records) - sum_of_logarithms(variance);
  result.likelihood_ratio = records * log_ratio;
  result.explained_share = 1.0 - std::exp(-log_ratio / parameters);
  result.mean -= result.coefficient * added.colwise().mean().transpose();
  return result;
}

bool is_possible(const MetaRegression& fit) {
  return fit.coefficient > 0.0 && fit.mean.size() > 0 && fit.mean.minCoeff() >= 0.0;
}

double permutation_p_value(const Eigen::MatrixXd& theta, const std::vector<Eigen::MatrixXd>& added, int permutations,
                           std::uint64_t seed) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(theta.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const auto best = [&] {
    double largest = 0.0;
    for (const Eigen::MatrixXd& one : added)
      if (const MetaRegression fitted = meta_regression(theta, one(order, Eigen::all)); is_possible(fitted))
        largest = std::max(largest, fitted.likelihood_ratio);
    return largest;
  };
  const double recorded = best();
  if (recorded <= 0.0) return 1.0;
  std::mt19937_64 random(seed);
  int reached = 1;
  for (int k = 1; k < permutations; ++k) {
    std::shuffle(order.begin(), order.end(), random);
    if (best() >= recorded) ++reached;
  }
  return static_cast<double>(reached) / permutations;
}

}  // namespace flexspline::selection
