#include "host/engine/selection/meta_regression.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace flexspline::selection {
namespace {

using Eigen::ArrayXXd;
using Eigen::RowVectorXd;

struct Fitted {
  double coefficient = 0.0;
  double coefficient_std = 0.0;
  double deviance = 0.0;  // minus twice the log-likelihood
  RowVectorXd mean;
  RowVectorXd between;  // T
};

// Alternates between mean and coefficient, by weighted least squares, and the variances between records. These begin at
// the variance of the parameters and are moved to where the derivative of the likelihood is zero (fixed point of
// Thompson and Sharp 1999, method 3); never below zero. `with` is false: the coefficient stays zero.
Fitted maximise_likelihood(const RecordParameters& records, const Eigen::MatrixXd& added, bool with) {
  const ArrayXXd theta = records.theta, p = added, within = records.variance;
  const auto weighted_mean = [](const ArrayXXd& w, const ArrayXXd& x) {
    return RowVectorXd(((w * x).colwise().sum() / w.colwise().sum()).matrix());
  };
  const auto centred = [](const ArrayXXd& x, const RowVectorXd& mean) { return ArrayXXd(x.rowwise() - mean.array()); };
  Fitted fit;
  const RowVectorXd all = theta.colwise().mean();
  const RowVectorXd spread = centred(theta, all).square().colwise().mean();
  fit.between = spread;
  const RowVectorXd least = 1e-12 * spread;
  constexpr int kRounds = 100;
  constexpr double kSame = 1e-9;
  ArrayXXd residual, variance;
  for (int round = 0; round < kRounds; ++round) {
    variance = within.rowwise() + fit.between.cwiseMax(least).array();
    const ArrayXXd w = variance.inverse();
    const RowVectorXd mean_theta = weighted_mean(w, theta), mean_added = weighted_mean(w, p);
    const ArrayXXd e = centred(theta, mean_theta), q = centred(p, mean_added);
    const double information = (w * q.square()).sum();
    if (with && information > 0.0) {
      fit.coefficient = (w * q * e).sum() / information;
      fit.coefficient_std = 1.0 / std::sqrt(information);
    }
    fit.mean = mean_theta - fit.coefficient * mean_added;
    residual = e - fit.coefficient * q;
    const RowVectorXd next = ((w.square() * (residual.square() - within)).colwise().sum() / w.square().colwise().sum())
                                 .matrix()
                                 .cwiseMax(0.0);
    const double moved = ((next - fit.between).array().abs() / spread.array().max(1e-300)).maxCoeff();
    fit.between = next;
    if (moved < kSame) break;
  }
  variance = within.rowwise() + fit.between.cwiseMax(least).array();
  fit.deviance = (variance.log() + residual.square() / variance).sum();
  return fit;
}

MetaRegression against(const Fitted& without, const RecordParameters& records, const Eigen::MatrixXd& added) {
  const Fitted with = maximise_likelihood(records, added, true);
  MetaRegression result;
  result.coefficient = with.coefficient;
  result.coefficient_std = with.coefficient_std;
  result.likelihood_ratio = without.deviance - with.deviance;
  const Eigen::ArrayXd before = without.between.array().max(1e-300);
  result.explained_share = std::max(0.0, 1.0 - (with.between.transpose().array() / before).mean());
  result.mean = with.mean.transpose();
  return result;
}

Fitted without_effect(const RecordParameters& records) {
  return maximise_likelihood(records, Eigen::MatrixXd::Zero(records.theta.rows(), records.theta.cols()), false);
}

}  // namespace

MetaRegression meta_regression(const RecordParameters& records, const Eigen::MatrixXd& added) {
  return against(without_effect(records), records, added);
}

bool is_possible(const MetaRegression& fit) {
  return fit.coefficient > 0.0 && fit.mean.size() > 0 && fit.mean.minCoeff() >= 0.0;
}

double permutation_p_value(const RecordParameters& records, const std::vector<Eigen::MatrixXd>& added, int permutations,
                           std::uint64_t seed) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(records.theta.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const Fitted without = without_effect(records);
  const auto best = [&] {
    double largest = 0.0;
    for (const Eigen::MatrixXd& one : added)
      if (const MetaRegression fitted = against(without, records, one(order, Eigen::all)); is_possible(fitted))
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
