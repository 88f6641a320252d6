#include "host/engine/estimation/record_factors.hpp"

#include <Eigen/Core>
#include <numeric>
#include "host/common/algebra/decompositions.hpp"

namespace flexspline::estimation {
double RecordFactors::rows_of(std::size_t record) const {
  return std::accumulate(rows[record].begin(), rows[record].end(), 0.0);
}

Eigen::MatrixXd combined_factor(const std::vector<const Eigen::MatrixXd*>& blocks) {
  Eigen::Index rows = 0;
  for (const Eigen::MatrixXd* block : blocks) rows += block->rows();
  Eigen::MatrixXd all(rows, blocks.front()->cols());
  rows = 0;
  for (const Eigen::MatrixXd* block : blocks) {
    all.middleRows(rows, block->rows()) = *block;
    rows += block->rows();
  }
  return algebra::r_factor(std::move(all));
}

RecordFactors record_factors(const RegressionProblem& data, const Eigen::MatrixXd& X, const Eigen::VectorXd& y,
                             const Eigen::VectorXd& keep, std::size_t parts) {
  RecordFactors t;
  const Eigen::Index columns = X.cols();
  t.size = (keep.asDiagonal() * X).colwise().norm().transpose().array().max(1e-300);
  const std::size_t records = data.records().size();
  t.parts.resize(records);
  t.rows.resize(records);
  for (const auto& fold : data.folds(parts))
    for (std::size_t i = 0; i < fold.size(); ++i) {
      const RowRange& range = fold[i];
      Eigen::MatrixXd block(range.size(), columns + 1);
      Eigen::Index used = 0;
      for (Eigen::Index row = range.first; row < range.last; ++row) {
        if (keep[row] == 0.0) continue;
        block.row(used).head(columns) = X.row(row).cwiseQuotient(t.size.transpose());
        block(used++, columns) = y[row];
      }
      block.conservativeResize(used, Eigen::NoChange);
      t.parts[i].push_back(algebra::r_factor(std::move(block)));
      t.rows[i].push_back(static_cast<double>(used));
    }
  for (const auto& of_record : t.parts) {
    std::vector<const Eigen::MatrixXd*> blocks;
    for (const Eigen::MatrixXd& part : of_record) blocks.push_back(&part);
    t.whole.push_back(blocks.size() == 1 ? of_record.front() : combined_factor(blocks));
  }
  return t;
}

}  // namespace flexspline::estimation
