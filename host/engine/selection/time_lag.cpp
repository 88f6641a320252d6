#include "host/engine/selection/time_lag.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "host/common/algebra/decompositions.hpp"
#include "host/common/signals/interpolate.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/selection/filtered_table.hpp"
#include "host/engine/selection/halves.hpp"
#include "host/engine/selection/setting.hpp"

namespace flexspline::selection {
namespace {

// A target as it was `lag_s` later.
Eigen::VectorXd shifted(const Eigen::VectorXd& now, const std::vector<Run>& runs, double lag_s) {
  Eigen::VectorXd target = now;
  for (const Run& run : runs) {
    const auto n = static_cast<std::size_t>(run.last - run.first);
    const std::vector<double> moved =
        signals::fractional_delay(std::span<const double>(now.data() + run.first, n), -lag_s / run.row_s);
    target.segment(run.first, run.last - run.first) =
        Eigen::Map<const Eigen::VectorXd>(moved.data(), run.last - run.first);
  }
  return target;
}

// The table with the model's columns, those of some terms and the target at each lag, in this order.
RegressorTable with_lags(const RegressorTable& table, const std::vector<int>& terms, const std::vector<double>& lags) {
  RegressorTable small;
  static_cast<TableSamples&>(small) = table;
  static_cast<TableModel&>(small) = table;
  std::vector<Eigen::Index> own;
  for (Eigen::Index j = 0; j < table.model_columns; ++j) own.push_back(j);
  for (const int t : terms)
    for (const Eigen::Index c : table.terms[static_cast<std::size_t>(t)].columns) own.push_back(c);
  const auto columns = static_cast<Eigen::Index>(own.size());
  small.columns.resize(table.columns.rows(), columns + static_cast<Eigen::Index>(lags.size()));
  small.columns.leftCols(columns) = table.columns(Eigen::all, own);
  for (std::size_t i = 0; i < lags.size(); ++i)
    small.columns.col(columns + static_cast<Eigen::Index>(i)) = shifted(table.target, table.runs, lags[i]);
  return small;
}

enum class Found { nothing, inside, at_end };
struct LagWithin {
  Found found = Found::nothing;
  TimeLag lag;
};

// The best of all lags of up to so many rows.
LagWithin best_lag_within(int most_rows, double row_s, const RegressorTable& table, const std::vector<int>& terms,
                          const SelectionPolicy& policy) {
  std::vector<double> lags;
  // Whole rows alone, as interpolation between them would take off noise.
  for (int k = -most_rows; k <= most_rows; ++k) lags.push_back(row_s * k);
  const RegressorTable small = with_lags(table, terms, lags);
  const ChosenColumns all = all_columns(small);
  // Away from reversals: around them presliding, and any error of a friction law, is a phase itself.
  const Setting setting = make_setting(filtered_table(small, all, table.highest_law_hz), all, true, false, policy);
  const auto tried = static_cast<Eigen::Index>(lags.size());
  const Eigen::Index columns = small.columns.cols() - tried;
  if (static_cast<double>(setting.rows.rows()) < policy.fewest_rows_per_column * static_cast<double>(columns))
    return {};
  Eigen::MatrixXd rows = setting.rows.leftCols(columns + tried);
  const std::vector<double> weights = record_weights(small, setting);
  for (const Run& run : setting.runs)
    rows.middleRows(run.first, run.last - run.first) *= std::sqrt(weights[run.record]);
  const Eigen::MatrixXd own = rows.leftCols(columns), targets = rows.rightCols(tried);
  const Eigen::MatrixXd residuals = targets - own * algebra::PivotedQr(own).solve(targets);
  const Eigen::VectorXd squares = residuals.colwise().squaredNorm();
  Eigen::Index best = 0;
  squares.minCoeff(&best);
  if (best == 0 || best == tried - 1) return {Found::at_end, {}};
  // The parabola through the least squares and its neighbours.
  const double before = squares[best - 1], least = squares[best], after = squares[best + 1];
  const double curvature = before - 2.0 * least + after;
  if (!(curvature > 0.0)) return {};
  const double step = lags[1] - lags[0];
  TimeLag lag;
  lag.lag_s = lags[static_cast<std::size_t>(best)] + 0.5 * step * (before - after) / curvature;
  std::vector<estimation::RowRange> ranges;
  for (const Run& run : setting.runs) ranges.push_back({run.record, run.first, run.last});
  const Eigen::VectorXd left = residuals.col(best);
  const double tau = std::max(1.0, estimation::autocorrelation_time(ranges, left));
  const double variance = left.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, left.size() - columns));
  // Squares over the lag are least + curvature/2 (lag/step)^2, and one standard error adds the variance, times the
  // samples that count as one.
  lag.std_s = step * std::sqrt(2.0 * variance * tau / curvature);
  const double without = squares[tried / 2];
  const double floor = std::min(semivariance(setting, left) * static_cast<double>(left.size()), 0.999 * without);
  lag.reduction_share = (without - least) / (without - floor);
  return {Found::inside, lag};
}

}  // namespace

std::optional<TimeLag> estimate_time_lag(const RegressorTable& table, const std::vector<int>& terms, LagRange range,
                                         const SelectionPolicy& policy) {
  double row_s = 0.0;
  for (const Run& run : table.runs) row_s = std::max(row_s, run.row_s);
  int most_rows = policy.usual_lag_rows;
  while (true) {
    const LagWithin best = best_lag_within(most_rows, row_s, table, terms, policy);
    if (best.found == Found::inside) return best.lag;
    const int longest = static_cast<int>(std::ceil(policy.longest_lag_s / row_s));
    if (best.found == Found::nothing || range == LagRange::usual || most_rows >= longest) return std::nullopt;
    most_rows = std::min(2 * most_rows, longest);
  }
}

void correct_time_lag(RegressorTable& table, double lag_s) {
  table.target = shifted(table.target, table.runs, lag_s);
  if (table.presliding) table.presliding->target = shifted(table.presliding->target, table.runs, lag_s);
}

}  // namespace flexspline::selection
