// What a search keeps of a regression: the R factor of [X y] (QR decomposition) for each record and each of its parts.
// Every fit, with any weights by record, with parts or columns left out, is algebra on these small matrices.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

struct RecordFactors {
  Eigen::VectorXd size;  // length of each column over the samples that count: the factors are of X/size
  // By record, then by part of it: R of [X/size, y] over the samples that count, upper triangular, columns + 1 wide.
  std::vector<std::vector<Eigen::MatrixXd>> parts;
  std::vector<std::vector<double>> rows;
  std::vector<Eigen::MatrixXd> whole;  // by record, of all its parts

  Eigen::Index columns() const { return size.size(); }
  double rows_of(std::size_t record) const;
};

// `keep` is zero for samples that do not count. Records are cut into `parts` pieces of equal length
// (RegressionProblem::folds).
RecordFactors record_factors(const RegressionProblem& data, const Eigen::MatrixXd& X, const Eigen::VectorXd& y,
                             const Eigen::VectorXd& keep, std::size_t parts);

// The R factor of matrices that are stacked. All have the same number of columns.
Eigen::MatrixXd combined_factor(const std::vector<const Eigen::MatrixXd*>& blocks);

}  // namespace flexspline::estimation
