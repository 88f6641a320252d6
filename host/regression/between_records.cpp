#include "host/regression/between_records.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <string_view>

#include "host/regression/least_squares.hpp"

namespace flexspline::regression {
namespace {

// Friction does not differ by more than that from run to run; records that know their factor no better than to a tenth
// tell nothing of it.
constexpr double kLargestSpread = 0.5;
constexpr double kTells = 0.1;
constexpr double kCertain = 0.95;

// A record's own factors and their errors, as it alone tells them.
struct Own {
  Eigen::MatrixXd torques;  // Z'Z over the noise
  Eigen::VectorXd along;    // Z'e over the noise
  Eigen::VectorXd value, variance;
};

std::vector<Own> factors(const BalanceData& data, const Eigen::MatrixXd& torques, const Eigen::VectorXd& residual,
                         const Eigen::VectorXd& left, double tau) {
  std::vector<Own> list;
  for (const RowRange& range : data.records()) {
    const auto Z = torques.middleRows(range.first, range.size());
    const double noise =
        std::max(left.segment(range.first, range.size()).squaredNorm() / static_cast<double>(range.size()), 1e-300) *
        tau;
    Own own;
    own.torques = Z.transpose() * Z / noise;
    own.along = Z.transpose() * residual.segment(range.first, range.size()) / noise;
    const Eigen::MatrixXd H = own.torques + Eigen::MatrixXd::Identity(Z.cols(), Z.cols()) / std::pow(kLargestSpread, 2);
    const Eigen::MatrixXd inverse = H.llt().solve(Eigen::MatrixXd::Identity(Z.cols(), Z.cols()));
    own.value = inverse * own.along;
    own.variance = inverse.diagonal();
    list.push_back(std::move(own));
  }
  return list;
}

// The variance between records at which the factors of a group scatter as they should; the records that tell, less one.
std::pair<double, double> variance_between(const std::vector<Own>& records, Eigen::Index group) {
  std::vector<std::pair<double, double>> told;  // value, variance
  for (const Own& own : records)
    if (own.variance[group] < kTells * kTells) told.emplace_back(own.value[group], own.variance[group]);
  if (told.size() < kFewestRecords) return {0.0, 0.0};
  const double freedom = static_cast<double>(told.size() - 1);
  const auto scatter = [&](double between) {
    double weights = 0.0, mean = 0.0, sum = 0.0;
    for (const auto& [value, variance] : told) {
      weights += 1.0 / (variance + between);
      mean += value / (variance + between);
    }
    mean /= weights;
    for (const auto& [value, variance] : told) sum += (value - mean) * (value - mean) / (variance + between);
    return sum;
  };
  if (scatter(0.0) <= boost::math::quantile(boost::math::chi_squared(freedom), kCertain)) return {0.0, 0.0};
  double low = 0.0, high = kLargestSpread * kLargestSpread;
  for (int i = 0; i < 60; ++i) (scatter(0.5 * (low + high)) > freedom ? low : high) = 0.5 * (low + high);
  return {0.5 * (low + high), freedom};
}

}  // namespace

std::vector<Group> friction_groups(const Terms& terms, const std::vector<Slot>& linear,
                                   const std::vector<Slot>& shapes) {
  std::vector<Group> groups;
  for (std::size_t j = 0; j < linear.size(); ++j) {
    const std::string_view surface = terms[linear[j].term].entry->info->surface;
    if (surface.empty()) continue;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.name == surface; });
    if (group == groups.end()) group = groups.insert(groups.end(), {std::string(surface), {}, {}});
    group->columns.push_back(static_cast<Eigen::Index>(j));
    const Term& term = terms[linear[j].term];
    const auto& varies = term.entry->parameters[linear[j].parameter];
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      const auto& shape = term.entry->parameters[shapes[k].parameter];
      // One in the same unit is a share of the friction, and varies with it.
      if (shapes[k].term == linear[j].term && shape.per == varies.name && shape.unit.rotary != varies.unit.rotary)
        group->stays.push_back({static_cast<Eigen::Index>(k), term.values[shapes[k].parameter]});
    }
  }
  return groups;
}

BetweenRecords between_records(const BalanceData& data, const Eigen::MatrixXd& torques,
                               const Eigen::VectorXd& residual) {
  BetweenRecords between;
  between.std = between.freedom = Eigen::VectorXd::Zero(torques.cols());
  between.left = residual;
  const auto tau = [&] {
    return std::max(autocorrelation_time(data.records(), between.left), data.filter_autocorrelation_time());
  };
  const auto take_off = [&](const RowRange& range, const Eigen::VectorXd& factors) {
    between.left.segment(range.first, range.size()) =
        residual.segment(range.first, range.size()) - torques.middleRows(range.first, range.size()) * factors;
  };
  // Differences of friction are slow: taken for noise, they would make noise look so slow that no difference is
  // certain. So the first look at the noise is at what each record leaves beside factors of its own.
  if (torques.cols() > 0) {
    const std::vector<Own> records = factors(data, torques, residual, residual, 1.0);
    for (std::size_t i = 0; i < records.size(); ++i) take_off(data.records()[i], records[i].value);
  }
  // Noise and its autocorrelation are those of what the factors leave, which depends on both.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds && torques.cols() > 0; ++round) {
    const std::vector<Own> records = factors(data, torques, residual, between.left, tau());
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
      take_off(data.records()[i], between.std.cwiseProduct(inner.llt().solve(scaled)));
    }
    if (between.std.maxCoeff() <= 0.0) break;
  }
  between.autocorrelation_time = tau();
  return between;
}

Eigen::MatrixXd directions(const std::vector<Group>& groups, const Eigen::VectorXd& theta, const Eigen::VectorXd& size,
                           Eigen::Index first_shape) {
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(theta.size(), static_cast<Eigen::Index>(groups.size()));
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto column = static_cast<Eigen::Index>(g);
    for (const Eigen::Index j : groups[g].columns) u(j, column) = theta[j];
    for (const Group::Stays& s : groups[g].stays)
      if (const Eigen::Index j = first_shape + s.shape; j < theta.size()) u(j, column) = -s.ratio * size[j];
  }
  return u;
}

bool leaves_noise(const BetweenRecords& between, const BalanceData& data) {
  constexpr double kNoise = 2.0;
  return between.autocorrelation_time <= kNoise * data.filter_autocorrelation_time();
}

Whitening whitening_of(const BalanceData& data, const Eigen::VectorXd& root_weights, const Eigen::MatrixXd& torques,
                       const Eigen::VectorXd& std, double autocorrelation_time) {
  Whitening whitening(root_weights);
  if (std.size() == 0 || std.maxCoeff() <= 0.0) return whitening;
  const Eigen::MatrixXd along = torques * std.asDiagonal() / std::sqrt(autocorrelation_time);
  for (const RowRange& range : data.records()) whitening.vary(range, along.middleRows(range.first, range.size()));
  return whitening;
}

Eigen::MatrixXd with_differences(const BetweenRecords& between, const BalanceData& data, const Eigen::MatrixXd& torques,
                                 const Eigen::MatrixXd& columns, const Eigen::MatrixXd& unit,
                                 const Eigen::MatrixXd& within) {
  Eigen::MatrixXd covariance = within;
  Eigen::VectorXd doubt = Eigen::VectorXd::Zero(within.rows());  // sum of squared parts over their freedom
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
    doubt += part.diagonal().cwiseAbs2() / between.freedom[g];
  }
  Eigen::VectorXd wider = Eigen::VectorXd::Ones(within.rows());
  for (Eigen::Index j = 0; j < wider.size(); ++j) {
    if (!(doubt[j] > 0.0)) continue;
    const double freedom = std::max(1.0, covariance(j, j) * covariance(j, j) / doubt[j]);
    wider[j] = boost::math::quantile(boost::math::students_t(freedom), 0.975) / 1.959963984540054;
  }
  return wider.asDiagonal() * covariance * wider.asDiagonal();
}

}  // namespace flexspline::regression
