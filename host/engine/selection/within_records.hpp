// What happens within records alone: both models have parameters of their own in each record (fixed effects), so that
// nothing between records counts.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::selection {

struct WithinRecords {
  double deviance = 0.0;  // twice the log-likelihood ratio of `extended` over `base`, of all records
  double least = 0.0;     // of the record that speaks most against `extended`; above zero where none does
};

// Regressions of `target` (one a sample) in each record, on the columns of `base` and on those of `extended`. Errors
// are correlated: so many samples count as one as the autocorrelation of what is left says. A record with fewer
// samples than columns does not count.
WithinRecords compare_within_records(const Eigen::VectorXd& target, const Eigen::MatrixXd& base,
                                     const Eigen::MatrixXd& extended, const std::vector<estimation::RowRange>& records);

}  // namespace flexspline::selection
