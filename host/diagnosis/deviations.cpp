#include "host/diagnosis/deviations.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace flexspline::diagnosis {
namespace {

constexpr double kLargestSpread = 0.5;
constexpr double kSmallestSpread = 1e-4;

// I + S Z'Z S/v: what deviations of standard deviation S add to noise of variance v.
Eigen::LLT<SmallMatrix> inner(const RecordSums& r, const SmallVector& std, double v) {
  SmallMatrix m = SmallMatrix::Identity(std.size(), std.size());
  m += std.asDiagonal() * r.own * std.asDiagonal() / v;
  return m.llt();
}

// What a record's deviations cost: ln det and e'V^-1 e, less what does not depend on the spread.
double cost(const RecordSums& r, const SmallVector& std, double v) {
  const Eigen::LLT<SmallMatrix> m = inner(r, std, v);
  const SmallVector g = std.cwiseProduct(r.along) / v;
  double log_det = 0.0;
  for (Eigen::Index k = 0; k < std.size(); ++k) log_det += 2.0 * std::log(m.matrixLLT()(k, k));
  return log_det - g.dot(m.solve(g));
}

// The best spread of one group, the others as they are: a grid, then golden sections. Nought where that is as good.
void choose(const std::vector<RecordSums>& records, const std::vector<double>& noise, Eigen::Index group,
            SmallVector& std) {
  const auto total = [&](double s) {
    std[group] = s;
    double sum = 0.0;
    for (std::size_t i = 0; i < records.size(); ++i) sum += cost(records[i], std, noise[i]);
    return sum;
  };
  constexpr int kSteps = 12;
  const double ratio = std::pow(kLargestSpread / kSmallestSpread, 1.0 / kSteps);
  double best = 0.0, least = total(0.0), at = kSmallestSpread;
  for (int k = 0; k <= kSteps; ++k, at *= ratio)
    if (const double c = total(at); c < least) {
      least = c;
      best = at;
    }
  if (best > 0.0) {
    constexpr double kGolden = 0.6180339887498949;
    double low = std::log(best / ratio), high = std::log(std::min(best * ratio, kLargestSpread));
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double at_a = total(std::exp(a)), at_b = total(std::exp(b));
    for (int k = 0; k < 10; ++k)
      if (at_a < at_b) {
        high = b;
        b = a;
        at_b = at_a;
        a = high - kGolden * (high - low);
        at_a = total(std::exp(a));
      } else {
        low = a;
        a = b;
        at_a = at_b;
        b = low + kGolden * (high - low);
        at_b = total(std::exp(b));
      }
    best = std::exp(0.5 * (low + high));
  }
  std[group] = best;
}

void settle(const std::vector<RecordSums>& records, double tau, double least_variance, Spread& spread) {
  for (std::size_t i = 0; i < records.size(); ++i) {
    const RecordSums& r = records[i];
    const SmallVector& b = spread.by_record[i] = best_deviations(r, spread.std, spread.variance[i] * tau);
    double squares = r.squares;
    if (b.size() > 0) squares += b.dot(r.own * b) - 2.0 * b.dot(r.along);
    spread.squares[i] = std::max(squares, 0.0);
    spread.variance[i] = std::max({spread.squares[i] / std::max(1.0, r.rows), least_variance, 1e-300});
  }
}

// Groups whose spread the records tell.
std::vector<std::uint8_t> told_by(const std::vector<RecordSums>& records) {
  const Eigen::Index groups = records.empty() ? 0 : records.front().along.size();
  std::vector<std::uint8_t> told;
  for (Eigen::Index g = 0; g < groups; ++g)
    told.push_back(static_cast<std::size_t>(std::count_if(records.begin(), records.end(), [&](const RecordSums& r) {
                     return r.own(g, g) > 0.0;
                   })) >= kFewestRecords);
  return told;
}

Spread estimate(const std::vector<RecordSums>& records, const SmallVector* given, double tau, double least_variance,
                const std::vector<double>& variance) {
  Spread spread;
  const Eigen::Index groups = records.empty() ? 0 : records.front().along.size();
  spread.std = given ? *given : SmallVector(SmallVector::Zero(groups));
  spread.by_record.assign(records.size(), SmallVector::Zero(groups));
  spread.squares.assign(records.size(), 0.0);
  for (std::size_t i = 0; i < records.size(); ++i)
    spread.variance.push_back(
        std::max({variance.empty() ? records[i].squares / std::max(1.0, records[i].rows) : variance[i], least_variance,
                  1e-300}));
  for (const RecordSums& r : records) spread.deviance.push_back(r.rows);
  const std::vector<std::uint8_t> told = told_by(records);
  constexpr int kRounds = 5;
  for (int round = 0; round < (groups > 0 ? kRounds : 1); ++round) {
    std::vector<double> noise;
    for (const double v : spread.variance) noise.push_back(v * tau);
    if (!given)
      for (Eigen::Index g = 0; g < groups; ++g)
        if (told[static_cast<std::size_t>(g)]) choose(records, noise, g, spread.std);
    settle(records, tau, least_variance, spread);
  }
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Cost cost = cost_of_deviations(records[i], spread.std, spread.variance[i] * tau);
    spread.deviance[i] = records[i].rows / tau * std::log(spread.variance[i]) + cost.squares + cost.log_det;
  }
  return spread;
}

}  // namespace

Spread estimate_spread(const std::vector<RecordSums>& records, double tau, double least_variance,
                       const std::vector<double>& variance) {
  return estimate(records, nullptr, tau, least_variance, variance);
}

Spread with_spread(const std::vector<RecordSums>& records, const SmallVector& std, double tau, double least_variance) {
  return estimate(records, &std, tau, least_variance, {});
}

Spread with_largest_spread(const std::vector<RecordSums>& records, double tau, double least_variance) {
  const std::vector<std::uint8_t> told = told_by(records);
  SmallVector std = SmallVector::Zero(static_cast<Eigen::Index>(told.size()));
  for (std::size_t g = 0; g < told.size(); ++g) std[static_cast<Eigen::Index>(g)] = told[g] ? kLargestSpread : 0.0;
  return estimate(records, &std, tau, least_variance, {});
}

SmallVector best_deviations(const RecordSums& r, const SmallVector& std, double v) {
  if (std.size() == 0) return std;
  const SmallVector g = std.cwiseProduct(r.along) / v;
  return std.cwiseProduct(inner(r, std, v).solve(g));
}

Cost cost_of_deviations(const RecordSums& r, const SmallVector& spread, double v) {
  Cost cost;
  const SmallVector b = best_deviations(r, spread, v);
  const Eigen::LLT<SmallMatrix> m = inner(r, spread, v);
  for (Eigen::Index g = 0; g < spread.size(); ++g) {
    cost.log_det += 2.0 * std::log(m.matrixLLT()(g, g));
    if (spread[g] > 0.0) cost.squares += b[g] * b[g] / (spread[g] * spread[g]);
  }
  return cost;
}

Eigen::MatrixXd without_deviations(const Eigen::MatrixXd& triangle, const Eigen::MatrixXd& u, const SmallVector& std,
                                   double noise_variance) {
  const double root = 1.0 / std::sqrt(noise_variance);
  const Eigen::Index groups = u.cols(), width = triangle.cols();
  if (groups == 0 || std.maxCoeff() <= 0.0) return root * triangle;
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(triangle.rows() + groups, groups + width);
  block.topLeftCorner(groups, groups).setIdentity();
  block.bottomLeftCorner(triangle.rows(), groups) = root * triangle.leftCols(width - 1) * u * std.asDiagonal();
  block.bottomRightCorner(triangle.rows(), width) = root * triangle;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(std::move(block));
  return qr.matrixQR().block(groups, groups, width, width).triangularView<Eigen::Upper>();
}

void add_sums(const Eigen::MatrixXd& triangle, const Eigen::VectorXd& theta, const Eigen::MatrixXd& u, double rows,
              RecordSums& sums) {
  const Eigen::Index columns = theta.size();
  if (sums.along.size() != u.cols()) {
    sums.along = SmallVector::Zero(u.cols());
    sums.own = SmallMatrix::Zero(u.cols(), u.cols());
  }
  const Eigen::VectorXd e = triangle.col(columns) - triangle.leftCols(columns) * theta;
  const Eigen::MatrixXd z = triangle.leftCols(columns) * u;
  sums.rows += rows;
  sums.squares += e.squaredNorm();
  sums.along += z.transpose() * e;
  sums.own += z.transpose() * z;
}

}  // namespace flexspline::diagnosis
