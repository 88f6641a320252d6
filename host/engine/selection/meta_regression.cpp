#include "host/engine/selection/meta_regression.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace flexspline::selection {
namespace {

using Eigen::ArrayXXd;
using Eigen::RowVectorXd;

struct Fitted {
  double coefficient = 0.0;
  double coefficient_std = 0.0;
  double deviance = 0.0;  // minus twice the log-likelihood
  double squares = 0.0;   // weighted, of what is left
  double freedom = 0.0;
  RowVectorXd mean;
  RowVectorXd between;  // T
};

// Alternates between mean and coefficient, by weighted least squares, and the variances between records. These begin at
// the variance of the parameters and are moved to where the derivative of the likelihood is zero (fixed point of
// Thompson and Sharp 1999, method 3); never below zero. What a record does not identify has weight zero. `with` is
// false: the coefficient stays zero.
Fitted maximise_likelihood(const RecordParameters& records, const Eigen::MatrixXd& added, bool with) {
  const ArrayXXd theta = records.theta, p = added;
  const ArrayXXd known = records.variance.array().isFinite().cast<double>();
  const ArrayXXd within = records.variance.array().isFinite().select(records.variance.array(), 0.0);
  const auto weighted_mean = [](const ArrayXXd& w, const ArrayXXd& x) {
    return RowVectorXd(((w * x).colwise().sum() / w.colwise().sum()).matrix());
  };
  const auto centred = [](const ArrayXXd& x, const RowVectorXd& mean) { return ArrayXXd(x.rowwise() - mean.array()); };
  Fitted fit;
  const RowVectorXd spread = weighted_mean(known, centred(theta, weighted_mean(known, theta)).square());
  fit.between = spread;
  const RowVectorXd least = 1e-12 * spread;
  constexpr int kRounds = 100;
  constexpr double kSame = 1e-9;
  ArrayXXd residual, variance;
  for (int round = 0; round < kRounds; ++round) {
    variance = within.rowwise() + fit.between.cwiseMax(least).array();
    const ArrayXXd w = known / variance;
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
  fit.squares = (known * residual.square() / variance).sum();
  fit.freedom = known.sum() - static_cast<double>(known.cols()) - (with ? 1.0 : 0.0);
  fit.deviance = (known * variance.log()).sum() + fit.squares;
  return fit;
}

MetaRegression against(const Fitted& without, const RecordParameters& records, const Eigen::MatrixXd& added) {
  const Fitted with = maximise_likelihood(records, added, true);
  MetaRegression result;
  result.coefficient = with.coefficient;
  result.coefficient_std = with.coefficient_std;
  result.likelihood_ratio = without.deviance - with.deviance;
  result.freedom = with.freedom;
  // The maximum of the likelihood takes the variances between records from as many squares as there are records.
  if (with.freedom > 0.0 && with.coefficient_std > 0.0)
    result.t = with.coefficient / (with.coefficient_std * std::sqrt(std::max(1.0, with.squares / with.freedom)));
  // Of the parameters that differ between records.
  const Eigen::ArrayXd before = without.between.array(), after = with.between.transpose().array();
  const double differing = (before > 0.0).cast<double>().sum();
  if (differing > 0.0)
    result.explained_share =
        std::max(0.0, (before > 0.0).select(1.0 - after / before.max(1e-300), 0.0).sum() / differing);
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

namespace {

// Records that identify the same parameters.
std::vector<std::vector<Eigen::Index>> strata_of(const Eigen::MatrixXd& variance) {
  std::map<std::vector<bool>, std::vector<Eigen::Index>> strata;
  for (Eigen::Index i = 0; i < variance.rows(); ++i) {
    std::vector<bool> known;
    for (Eigen::Index j = 0; j < variance.cols(); ++j) known.push_back(std::isfinite(variance(i, j)));
    strata[known].push_back(i);
  }
  std::vector<std::vector<Eigen::Index>> list;
  for (auto& [known, records] : strata) list.push_back(std::move(records));
  return list;
}

}  // namespace

RecordSubset every_record(const RecordParameters& records) {
  RecordSubset all;
  for (Eigen::Index i = 0; i < records.theta.rows(); ++i) all.records.push_back(i);
  for (Eigen::Index j = 0; j < records.theta.cols(); ++j) all.parameters.push_back(j);
  return all;
}

double permutation_p_value(const RecordParameters& records, const std::vector<Eigen::MatrixXd>& added,
                           const std::vector<RecordSubset>& parts, int permutations, std::uint64_t seed) {
  std::vector<RecordParameters> in_part;
  std::vector<Fitted> without;
  for (const RecordSubset& part : parts) {
    in_part.push_back(part(records));
    without.push_back(without_effect(in_part.back()));
  }
  const auto best = [&](const std::vector<Eigen::Index>& order) {
    double largest = 0.0;
    for (const Eigen::MatrixXd& one : added) {
      const Eigen::MatrixXd permuted = one(order, Eigen::all);
      for (std::size_t k = 0; k < parts.size(); ++k)
        if (const MetaRegression fitted = against(without[k], in_part[k], parts[k](permuted)); is_possible(fitted))
          largest = std::max(largest, fitted.likelihood_ratio);
    }
    return largest;
  };
  std::vector<Eigen::Index> order = every_record(records).records;
  const double recorded = best(order);
  if (recorded <= 0.0) return 1.0;
  const std::vector<std::vector<Eigen::Index>> strata = strata_of(records.variance);
  std::mt19937_64 random(seed);
  constexpr int kEnough = 20;
  int reached = 1, tried = 1;
  for (; tried < permutations && reached < kEnough; ++tried) {
    for (const std::vector<Eigen::Index>& stratum : strata) {
      std::vector<Eigen::Index> drawn = stratum;
      std::shuffle(drawn.begin(), drawn.end(), random);
      for (std::size_t i = 0; i < drawn.size(); ++i) order[static_cast<std::size_t>(stratum[i])] = drawn[i];
    }
    if (best(order) >= recorded) ++reached;
  }
  return static_cast<double>(reached) / tried;
}

}  // namespace flexspline::selection
