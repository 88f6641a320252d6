#include "host/engine/estimation/variance_components.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include "host/common/algebra/decompositions.hpp"

namespace flexspline::estimation {
namespace {

constexpr std::size_t kFewestOfRecords = 3;
constexpr int kRemlIterations = 200;
constexpr double kRemlConverged = 1e-4;  // relative change of a variance
constexpr double kRemlStart = 0.01;      // variance

}  // namespace

VarianceComponents reml(const std::vector<RecordProducts>& records, double noise, double least, double most,
                        const VariancePrior& prior) {
  VarianceComponents result;
  if (records.empty()) return result;
  const Eigen::Index k = records.front().zz.rows(), p = records.front().xx.rows();
  result.variance = Eigen::VectorXd::Zero(k);
  result.beta = Eigen::VectorXd::Zero(p);
  result.b.assign(records.size(), Eigen::VectorXd::Zero(k));
  const std::size_t fewest = prior.records > 0.0 ? 2 : kFewestOfRecords;
  if (records.size() < fewest || k == 0 || !(noise > 0.0)) return result;
  Eigen::VectorXd variance = Eigen::VectorXd::Constant(k, std::min(kRemlStart, most * most));
  std::vector<Eigen::MatrixXd> inverse(records.size());
  for (int iteration = 0; iteration < kRemlIterations; ++iteration) {
    // Mixed-model equations, each record's own coefficients eliminated.
    Eigen::MatrixXd inner = Eigen::MatrixXd::Zero(p, p);
    Eigen::VectorXd along = Eigen::VectorXd::Zero(p);
    for (std::size_t r = 0; r < records.size(); ++r) {
      Eigen::MatrixXd own = records[r].zz / noise;
      own.diagonal() += variance.cwiseInverse();
      inverse[r] = algebra::inverse_of_positive(own);
      const Eigen::MatrixXd gain = records[r].xz * inverse[r] / noise;
      inner += (records[r].xx - gain * records[r].xz.transpose()) / noise;
      along += (records[r].xy - gain * records[r].zy) / noise;
    }
    const double scale = inner.diagonal().maxCoeff();
    inner.diagonal().array() += 1e-10 * scale;
    const algebra::SymmetricFactor solver(inner);
    result.beta = solver.solve(along);
    Eigen::VectorXd next = Eigen::VectorXd::Zero(k);
    for (std::size_t r = 0; r < records.size(); ++r) {
      const Eigen::MatrixXd zx = records[r].xz.transpose();
      result.b[r] = inverse[r] * (records[r].zy - zx * result.beta) / noise;
      const Eigen::MatrixXd through = inverse[r] * zx / noise;
      const Eigen::MatrixXd spread = inverse[r] + through * solver.solve(through.transpose());
      next += result.b[r].cwiseAbs2() + spread.diagonal();
    }
    next.array() += prior.records * prior.std * prior.std;
    next /= static_cast<double>(records.size()) + prior.records;
    next = next.cwiseMin(most * most).cwiseMax(1e-12);
    const double change = ((next - variance).cwiseAbs().cwiseQuotient(variance)).maxCoeff();
    variance = next;
    if (change < kRemlConverged) break;
  }
  for (Eigen::Index g = 0; g < k; ++g) result.variance[g] = variance[g] > least * least ? variance[g] : 0.0;
  return result;
}

}  // namespace flexspline::estimation
