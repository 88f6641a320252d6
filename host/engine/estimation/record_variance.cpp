#include "host/engine/estimation/record_variance.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/common/numbers/distributions.hpp"
#include "host/engine/estimation/least_squares.hpp"

namespace flexspline::estimation {
namespace {

// Largest difference of friction between runs; records whose factor is known to no better than a tenth do not count.
constexpr double kLargestDifference = 0.5;
constexpr double kKnownTo = 0.1;
constexpr double kCertain = 0.95;

// A record's own factors and their errors, from that record alone.
struct OwnFactors {
  Eigen::MatrixXd torques;  // Z'Z over the noise
  Eigen::VectorXd along;    // Z'e over the noise
  Eigen::VectorXd value, variance;
};

std::vector<OwnFactors> own_factors(const RegressionProblem& data, const Eigen::MatrixXd& torques,
                                    const Eigen::VectorXd& residual, const Eigen::VectorXd& left, double tau) {
  std::vector<OwnFactors> list;
  for (const RowRange& range : data.records()) {
    const auto Z = torques.middleRows(range.first, range.size());
    const double noise =
        std::max(left.segment(range.first, range.size()).squaredNorm() / static_cast<double>(range.size()), 1e-300) *
        tau;
    OwnFactors own;
    own.torques = Z.transpose() * Z / noise;
    own.along = Z.transpose() * residual.segment(range.first, range.size()) / noise;
    const Eigen::MatrixXd H =
        own.torques + Eigen::MatrixXd::Identity(Z.cols(), Z.cols()) / std::pow(kLargestDifference, 2);
    const Eigen::MatrixXd inverse = algebra::inverse_of_positive(H);
    own.value = inverse * own.along;
    own.variance = inverse.diagonal();
    list.push_back(std::move(own));
  }
  return list;
}

// The variance between records at which the factors of a group scatter as they should; the records that identify it,
// less one.
std::pair<double, double> variance_between(const std::vector<OwnFactors>& records, Eigen::Index group) {
  std::vector<std::pair<double, double>> identified;  // value, variance
  for (const OwnFactors& own : records)
    if (own.variance[group] < kKnownTo * kKnownTo) identified.emplace_back(own.value[group], own.variance[group]);
  if (identified.size() < kFewestRecords) return {0.0, 0.0};
  const double freedom = static_cast<double>(identified.size() - 1);
  const auto scatter = [&](double between) {
    double weights = 0.0, mean = 0.0, sum = 0.0;
    for (const auto& [value, variance] : identified) {
      weights += 1.0 / (variance + between);
      mean += value / (variance + between);
    }
    mean /= weights;
    for (const auto& [value, variance] : identified) sum += (value - mean) * (value - mean) / (variance + between);
    return sum;
  };
  if (scatter(0.0) <= numbers::chi_squared_quantile(freedom, kCertain)) return {0.0, 0.0};
  double low = 0.0, high = kLargestDifference * kLargestDifference;
  for (int i = 0; i < 60; ++i) (scatter(0.5 * (low + high)) > freedom ? low : high) = 0.5 * (low + high);
  return {0.5 * (low + high), freedom};
}

}  // namespace

RecordVariance paule_mandel(const RegressionProblem& data, const Eigen::MatrixXd& torques,
                            const Eigen::VectorXd& residual) {
  constexpr double kNoise = 2.0;
  const double filter_time = data.filter_autocorrelation_time();
  RecordVariance between;
  between.std = between.freedom = Eigen::VectorXd::Zero(torques.cols());
  between.left = residual;
  const auto tau = [&] { return std::max(autocorrelation_time(data.records(), between.left), filter_time); };
  const auto take_off = [&](const RowRange& range, const Eigen::VectorXd& factors) {
    between.left.segment(range.first, range.size()) =
        residual.segment(range.first, range.size()) - torques.middleRows(range.first, range.size()) * factors;
  };
  // Differences of friction are slow: taken for noise, they would make noise look so slow that no difference is
  // certain. So the noise is first estimated from the residual after each record has its own factors.
  if (torques.cols() > 0) {
    const std::vector<OwnFactors> records = own_factors(data, torques, residual, residual, 1.0);
    for (std::size_t i = 0; i < records.size(); ++i) take_off(data.records()[i], records[i].value);
  }
  // Noise and its autocorrelation are those of what the factors leave, which depends on both.
  constexpr int kRefinements = 3;
  for (int round = 0; round < kRefinements && torques.cols() > 0; ++round) {
    const std::vector<OwnFactors> records = own_factors(data, torques, residual, between.left, tau());
    for (Eigen::Index g = 0; g < torques.cols(); ++g) {
      const auto [variance, freedom] = variance_between(records, g);
      between.std[g] = std::sqrt(variance);
      between.freedom[g] = freedom;
    }
    // The likeliest factors: (I + S Z'Z S)^-1 S Z'e, times S.
    for (std::size_t i = 0; i < records.size(); ++i) {
      Eigen::MatrixXd inner = between.std.asDiagonal() * records[i].torques * between.std.asDiagonal();
      inner.diagonal().array() += 1.0;
      const Eigen::VectorXd scaled = between.std.cwiseProduct(records[i].along);
      take_off(data.records()[i], between.std.cwiseProduct(algebra::solve_positive(inner, scaled).col(0)));
    }
    if (between.std.maxCoeff() <= 0.0) break;
  }
  between.autocorrelation_time = tau();
  between.leaves_noise = between.autocorrelation_time <= kNoise * filter_time;
  return between;
}

Eigen::MatrixXd add_record_variance(const RecordVariance& between, const RegressionProblem& data,
                                    const Eigen::MatrixXd& torques, const Eigen::MatrixXd& columns,
                                    const Eigen::MatrixXd& unit, const Eigen::MatrixXd& within) {
  Eigen::MatrixXd covariance = within;
  Eigen::VectorXd uncertainty = Eigen::VectorXd::Zero(within.rows());  // sum of squared parts over their freedom
  for (Eigen::Index g = 0; g < torques.cols(); ++g) {
    if (!(between.std[g] > 0.0)) continue;
    Eigen::MatrixXd part = Eigen::MatrixXd::Zero(within.rows(), within.cols());
    for (const RowRange& range : data.records()) {
      const Eigen::VectorXd moved =
          between.std[g] * (unit * (columns.middleRows(range.first, range.size()).transpose() *
                                    torques.col(g).segment(range.first, range.size())));
      part += moved * moved.transpose();
    }
    covariance += part;
    uncertainty += part.diagonal().cwiseAbs2() / between.freedom[g];
  }
  Eigen::VectorXd wider = Eigen::VectorXd::Ones(within.rows());
  for (Eigen::Index j = 0; j < wider.size(); ++j) {
    if (!(uncertainty[j] > 0.0)) continue;
    const double freedom = std::max(1.0, covariance(j, j) * covariance(j, j) / uncertainty[j]);
    wider[j] = numbers::student_t_quantile(freedom, 0.975) / 1.959963984540054;
  }
  return wider.asDiagonal() * covariance * wider.asDiagonal();
}

}  // namespace flexspline::estimation
