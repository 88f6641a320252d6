#include "host/engine/selection/within_records.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/engine/estimation/least_squares.hpp"

namespace flexspline::selection {

WithinRecords compare_within_records(const Eigen::VectorXd& target, const Eigen::MatrixXd& base,
                                     const Eigen::MatrixXd& extended,
                                     const std::vector<estimation::RowRange>& records) {
  WithinRecords result;
  double least = std::numeric_limits<double>::infinity();
  for (const estimation::RowRange& range : records) {
    const Eigen::Index n = range.size();
    if (n <= std::max(base.cols(), extended.cols())) continue;
    const auto residual_of = [&](const Eigen::MatrixXd& columns) -> Eigen::VectorXd {
      return estimation::least_squares(columns.middleRows(range.first, n), target.segment(range.first, n),
                                       Eigen::VectorXd::Ones(n))
          .residual;
    };
    const Eigen::VectorXd before = residual_of(base), after = residual_of(extended);
    const double tau = estimation::autocorrelation_time({{range.record, 0, n}}, after);
    const double deviance = static_cast<double>(n) / tau *
                            std::log(std::max(before.squaredNorm(), 1e-300) / std::max(after.squaredNorm(), 1e-300));
    result.deviance += deviance;
    least = std::min(least, deviance);
  }
  if (std::isfinite(least)) result.least = least;
  return result;
}

}  // namespace flexspline::selection
