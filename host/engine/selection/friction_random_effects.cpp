#include "host/engine/selection/friction_random_effects.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numeric>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/variance_components.hpp"

namespace flexspline::selection {
namespace {

// Those that differ at all.
std::vector<Eigen::Index> components(const FrictionRandomEffects& differences) {
  std::vector<Eigen::Index> vary;
  for (Eigen::Index g = 0; g < differences.variance.size(); ++g)
    if (differences.variance[g] > 0.0) vary.push_back(g);
  return vary;
}

}  // namespace

std::vector<Eigen::Index> columns_that_differ(const FrictionRandomEffects& differences) {
  std::vector<Eigen::Index> columns;
  for (const Eigen::Index g : components(differences))
    columns.push_back(differences.columns[static_cast<std::size_t>(g)]);
  return columns;
}

Eigen::MatrixXd eliminated_factor(const Eigen::MatrixXd& along, const FrictionRandomEffects& differences) {
  const std::vector<Eigen::Index> vary = components(differences), columns = columns_that_differ(differences);
  Eigen::MatrixXd inner = along(columns, Eigen::all);
  for (Eigen::Index i = 0; i < inner.rows(); ++i)
    inner(i, i) += differences.noise / differences.variance[vary[static_cast<std::size_t>(i)]];
  return inner.llt().matrixL().solve(along.transpose()).transpose();
}

void eliminate_friction_effects(Eigen::MatrixXd& products, const FrictionRandomEffects& differences) {
  const std::vector<Eigen::Index> columns = columns_that_differ(differences);
  if (columns.empty()) return;
  const Eigen::MatrixXd factor = eliminated_factor(products(Eigen::all, columns), differences);
  products.noalias() -= factor * factor.transpose();
}

Eigen::VectorXd friction_effects_of(const RegressorTable& table, const Setting& setting, Direction direction,
                                    const std::vector<double>& weights, double noise, const SelectionPolicy& policy) {
  std::vector<Eigen::Index> fixed(static_cast<std::size_t>(table.model_columns));
  std::iota(fixed.begin(), fixed.end(), Eigen::Index{0});
  fixed.insert(fixed.end(), table.differences.begin(), table.differences.end());
  std::vector<estimation::RecordProducts> records;
  const auto k = static_cast<Eigen::Index>(table.differences.size());
  Eigen::VectorXd size(k);
  for (Eigen::Index g = 0; g < k; ++g) size[g] = table.scale[table.differences[static_cast<std::size_t>(g)]];
  for (const BlockRange& blocks : blocks_by_record(setting)) {
    const Eigen::MatrixXd own = weights[blocks.record] * products_of(setting, blocks, direction);
    const Eigen::Index y = own.cols() - 1;
    estimation::RecordProducts r;
    r.xx = own(fixed, fixed);
    r.xz = own(fixed, table.differences) * size.asDiagonal();
    r.zz = size.asDiagonal() * own(table.differences, table.differences) * size.asDiagonal();
    r.xy = own(fixed, y);
    r.zy = size.asDiagonal() * own(table.differences, y);
    records.push_back(std::move(r));
  }
  // Columns of the table are scaled; one unit is the friction over that scale.
  const estimation::VariancePrior prior =
      records.size() < policy.records_without_prior
          ? estimation::VariancePrior{policy.friction_difference, policy.friction_difference_records}
          : estimation::VariancePrior{};
  const Eigen::VectorXd variance =
      estimation::reml(records, noise, policy.least_friction_difference, policy.most_friction_difference, prior)
          .variance;
  return variance.cwiseProduct(size.cwiseAbs2());
}

Eigen::VectorXd weighted_residual(const Setting& setting, Direction direction, const TermFit& fitted,
                                  const std::vector<double>& weights, const FrictionRandomEffects& differences) {
  Eigen::VectorXd residual = setting.target(direction);
  for (std::size_t j = 0; j < fitted.columns.size(); ++j)
    residual -= fitted.theta[static_cast<Eigen::Index>(j)] * setting.column(fitted.columns[j], direction);
  const std::vector<Eigen::Index> vary = components(differences);
  const auto k = static_cast<Eigen::Index>(vary.size());
  for (std::size_t first = 0; first < setting.runs.size();) {
    std::size_t last = first;
    const std::size_t record = setting.runs[first].record;
    while (last < setting.runs.size() && setting.runs[last].record == record) ++last;
    const Eigen::Index from = setting.runs[first].first, rows = setting.runs[last - 1].last - from;
    if (k > 0) {
      Eigen::MatrixXd Z(rows, k);
      for (Eigen::Index j = 0; j < k; ++j)
        Z.col(j) =
            setting.column(differences.columns[static_cast<std::size_t>(vary[static_cast<std::size_t>(j)])], direction)
                .segment(from, rows);
      Eigen::MatrixXd inner = weights[record] * Z.transpose() * Z;
      for (Eigen::Index j = 0; j < k; ++j)
        inner(j, j) += differences.noise / differences.variance[vary[static_cast<std::size_t>(j)]];
      residual.segment(from, rows) -=
          Z * algebra::solve_positive(inner, weights[record] * (Z.transpose() * residual.segment(from, rows)));
    }
    residual.segment(from, rows) *= std::sqrt(weights[record]);
    first = last;
  }
  return residual;
}

}  // namespace flexspline::selection
