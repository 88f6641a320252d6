#include "host/engine/selection/filtered_table.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "host/common/signals/butterworth.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

constexpr double kRowsPerPeriod = 4.0;

Eigen::Index reach_of(const Run& run, double cutoff_hz) {
  return static_cast<Eigen::Index>(std::lround(kFilterReach / (cutoff_hz * run.row_s)));
}

// Of each sample of a run.
std::vector<SampleState> states_of(const RegressorTable& table, const Run& run, double cutoff_hz) {
  const Eigen::Index n = run.last - run.first, reach = reach_of(run, cutoff_hz);
  std::vector<SampleState> states(static_cast<std::size_t>(n), SampleState::in_motion);
  const auto set = [&](Eigen::Index first, Eigen::Index last, SampleState state) {
    for (Eigen::Index j = std::max<Eigen::Index>(0, first); j < std::min(n, last); ++j)
      states[static_cast<std::size_t>(j)] = state;
  };
  for (Eigen::Index k = 0; k < n; ++k) {
    const double v = table.velocity_over_noise[run.first + k];
    const double before = k > 0 ? table.velocity_over_noise[run.first + k - 1] : v;
    if (!std::isinf(v) && (std::abs(v) <= kPolicy.visible_velocity || v * before < 0.0))
      set(k - reach, k + reach + 1, SampleState::near_reversal);
  }
  // Where the axis is at rest, friction takes any value up to its limit, whatever law holds in motion: what the filter
  // makes of that says nothing.
  const auto rest_rows = std::max<Eigen::Index>(2, std::lround(kPolicy.rest_periods / (cutoff_hz * run.row_s)));
  for (Eigen::Index k = 0; k < n;) {
    Eigen::Index end = k;
    while (end < n && std::abs(table.velocity_over_noise[run.first + end]) <= kPolicy.visible_velocity) ++end;
    if (end - k >= rest_rows) set(k - reach, end + reach, SampleState::at_rest);
    k = std::max(end, k + 1);
  }
  return states;
}

// Rows of a run that are kept.
struct Decimation {
  Eigen::Index first = 0, step = 1, rows = 0;
};

Decimation decimation_of(const Run& run, double cutoff_hz) {
  Decimation d;
  const Eigen::Index n = run.last - run.first;
  d.step = std::max<Eigen::Index>(
      1, static_cast<Eigen::Index>(std::floor(1.0 / (kRowsPerPeriod * cutoff_hz * run.row_s) + 1e-6)));
  d.first = std::min(reach_of(run, cutoff_hz), n / 10);
  d.rows = (n - 2 * d.first + d.step - 1) / d.step;
  return d;
}

// Where one column of a table is taken from and put.
struct ColumnPair {
  const double* from;
  double* into;
};

// The columns and targets that a filtered table takes.
std::vector<ColumnPair> column_pairs(const RegressorTable& table, const ChosenColumns& chosen, RegressorTable& made) {
  std::vector<ColumnPair> pairs;
  for (std::size_t j = 0; j < chosen.columns.size(); ++j)
    pairs.push_back({table.columns.col(chosen.columns[j]).data(), made.columns.col(std::ssize(pairs)).data()});
  pairs.push_back({table.target.data(), made.target.data()});
  if (!made.presliding) return pairs;
  PreslidingColumns& into = *made.presliding;
  for (std::size_t j = 0; j < chosen.presliding.size(); ++j)
    pairs.push_back({table.presliding->columns.col(chosen.presliding[j]).data(),
                     into.columns.col(static_cast<Eigen::Index>(j)).data()});
  pairs.push_back({table.presliding->target.data(), into.target.data()});
  return pairs;
}

// Filters the samples of a run of `table` into those of `made`.
void filter_run(const RegressorTable& table, std::span<const ColumnPair> pairs, const Run& run,
                const RegressorTable& made, const Run& into) {
  constexpr std::size_t kTogether = 8;  // columns: as many as are filtered at once, and stay in the cache
  const Eigen::Index n = run.last - run.first;
  const Decimation d = decimation_of(run, made.highest_hz);
  const bool is_narrower = made.highest_hz < 0.99 * table.highest_hz;
  const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                        std::min(made.highest_hz, 0.45 / run.row_s), 1.0 / run.row_s);
  Eigen::MatrixXd rows;
  for (std::size_t first = 0; first < pairs.size(); first += kTogether) {
    const auto some = pairs.subspan(first, std::min(kTogether, pairs.size() - first));
    rows.resize(n, std::ssize(some));
    for (std::size_t j = 0; j < some.size(); ++j)
      std::copy_n(some[j].from + run.first, n, rows.col(static_cast<Eigen::Index>(j)).data());
    if (is_narrower) filter.apply_columns_in_place(rows);
    for (std::size_t j = 0; j < some.size(); ++j)
      for (Eigen::Index k = 0; k < d.rows; ++k)
        some[j].into[into.first + k] = rows(d.first + k * d.step, static_cast<Eigen::Index>(j));
  }
}

}  // namespace

RegressorTable filtered_table(const RegressorTable& table, ChosenColumns chosen, double cutoff_hz) {
  RegressorTable made = std::move(chosen.table);
  made.highest_hz = cutoff_hz;
  Eigen::Index rows = 0;
  for (const Run& run : table.runs) {
    const Decimation d = decimation_of(run, cutoff_hz);
    made.runs.push_back({run.record, rows, rows + d.rows, run.row_s * static_cast<double>(d.step)});
    rows += d.rows;
    const std::vector<SampleState> states = states_of(table, run, cutoff_hz);
    for (Eigen::Index k = 0; k < d.rows; ++k)
      made.states.push_back(states[static_cast<std::size_t>(d.first + k * d.step)]);
  }
  made.columns.resize(rows, made.columns.cols());
  made.target.resize(rows);
  if (made.presliding) {
    made.presliding->columns.resize(rows, made.presliding->columns.cols());
    made.presliding->target.resize(rows);
  }
  const std::vector<ColumnPair> pairs = column_pairs(table, chosen, made);
  for (std::size_t i = 0; i < table.runs.size(); ++i) filter_run(table, pairs, table.runs[i], made, made.runs[i]);
  return made;
}

void filter_targets(const RegressorTable& table, RegressorTable& filtered) {
  ChosenColumns targets = all_columns(table);
  targets.columns.clear();
  targets.presliding.clear();
  targets.table.columns.resize(0, 0);
  if (targets.table.presliding) targets.table.presliding->columns.resize(0, 0);
  RegressorTable made = filtered_table(table, std::move(targets), filtered.highest_hz);
  filtered.target = std::move(made.target);
  if (filtered.presliding) filtered.presliding->target = std::move(made.presliding->target);
}

}  // namespace flexspline::selection
