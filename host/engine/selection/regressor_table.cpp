#include "host/engine/selection/regressor_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "host/common/algebra/root_mean_square.hpp"
#include "host/common/numbers/quantile.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/selection/presliding.hpp"
#include "host/engine/selection/table_builder.hpp"
#include "host/physics/catalogue/order_causes.hpp"

namespace flexspline::selection {
namespace {

using estimation::PreparedData;
using estimation::Record;
using estimation::RegressionProblem;
using estimation::Terms;

// E[sign v] of a velocity with normal noise: erf(v / (sqrt 2 sigma)).
std::vector<double> expected_sign(const Record& record) {
  std::vector<double> sign(record.inputs.size(), 0.0);
  const double width = std::numbers::sqrt2 * std::max(record.velocity_noise[0], 1e-12);
  for (std::size_t k = 0; k < sign.size(); ++k) sign[k] = std::erf(record.inputs.velocity_at(k) / width);
  return sign;
}

void add_runs(const RegressionProblem& data, RegressorTable& table) {
  for (const estimation::RowRange& range : data.records()) {
    const Record& r = data.prepared().records[range.record];
    const auto& samples = r.rows[estimation::index(data.balance())].samples;
    const double row_s = r.sample_s * static_cast<double>(r.decimation);
    Eigen::Index first = range.first;
    for (std::size_t k = 1; k <= samples.size(); ++k)
      if (k == samples.size() || samples[k] != samples[k - 1] + r.decimation) {
        const Eigen::Index last = range.first + static_cast<Eigen::Index>(k);
        if (last - first >= 16) table.runs.push_back({range.record, first, last, row_s});
        first = last;
      }
  }
}

// What masks need: velocities over their noise, and how often the motion reverses.
void add_row_signals(const TableBuilder& builder) {
  RegressorTable& table = builder.table;
  const Balance balance = builder.sign.data.balance();
  table.velocity_over_noise = builder.sign.at_rows([&](const Record& r, std::size_t k) {
    return r.at_rest ? effects::kUnbounded
                     : r.direction_variable(balance, k) / std::max(r.velocity_noise[estimation::index(balance)], 1e-12);
  });
  for (const Run& run : table.runs) {
    double sign = 0.0;
    for (Eigen::Index k = run.first; k < run.last; ++k) {
      const double v = table.velocity_over_noise[k];
      if (std::abs(v) < 3.0 || std::isinf(v)) continue;
      if (v * sign < 0.0) table.reversals += 1.0;
      sign = v;
    }
  }
}

// What a column is divided by.
double unit_of(const Eigen::VectorXd& column) {
  const double size = algebra::root_mean_square(column);
  return size > 0.0 && std::isfinite(size) ? size : 1.0;
}

// Columns over their root mean squares.
void scale_columns(const TableBuilder& builder) {
  RegressorTable& table = builder.table;
  const auto rows = table.target.size();
  table.columns.resize(rows, std::ssize(builder.columns));
  table.scale.resize(std::ssize(builder.columns));
  estimation::in_parallel(builder.columns.size(), [&](std::size_t i) {
    const auto j = static_cast<Eigen::Index>(i);
    table.scale[j] = unit_of(builder.columns[i]);
    table.columns.col(j) = builder.columns[i] / table.scale[j];
  });
  for (CandidateTerm& term : table.terms)
    if (term.most_at_peak > 0.0) term.most_at_peak *= table.scale[term.columns.front()];
  if (!table.presliding) return;
  PreslidingColumns& presliding = *table.presliding;
  const auto differ = static_cast<Eigen::Index>(builder.presliding_columns.size());
  presliding.columns.resize(rows, differ + static_cast<Eigen::Index>(builder.shapes.size()));
  for (Eigen::Index i = 0; i < differ; ++i)
    presliding.columns.col(i) = builder.presliding_columns[static_cast<std::size_t>(i)] /
                                table.scale[presliding.instead_of[static_cast<std::size_t>(i)]];
  for (std::size_t i = 0; i < builder.shapes.size(); ++i)
    presliding.columns.col(differ + static_cast<Eigen::Index>(i)) = builder.shapes[i] / unit_of(builder.shapes[i]);
}

}  // namespace

double highest_order(const model::Drive& drive) {
  double highest = kPolicy.highest_order;
  for (const catalogue::Entry& entry : catalogue::all())
    for (const double order : catalogue::orders_of_motor(entry, drive)) highest = std::max(highest, order);
  return highest;
}

double highest_order_hz(const PreparedData& prepared) {
  std::vector<double> speeds;
  for (const Record& r : prepared.records)
    for (std::size_t k = 0; k < r.inputs.size() && !r.inputs.velocity.empty(); k += r.decimation)
      speeds.push_back(std::abs(r.inputs.velocity_at(k)));
  const bool turns = prepared.rotary || prepared.constants.turn_angle_scale != 1.0;
  return turns ? highest_order(prepared.drive) * numbers::quantile(speeds, 0.5) * prepared.constants.turn_angle_scale /
                     (2.0 * std::numbers::pi)
               : 0.0;
}

std::vector<Eigen::Index> RegressorTable::presliding_shape() const {
  std::vector<Eigen::Index> places;
  if (presliding)
    for (auto i = std::ssize(presliding->instead_of); i < presliding->columns.cols(); ++i)
      places.push_back(scale.size() + static_cast<Eigen::Index>(places.size()));
  return places;
}

namespace {

RegressorTable without_columns(const RegressorTable& table) {
  RegressorTable same;
  static_cast<TableModel&>(same) = table;
  same.records = table.records;
  same.held_out = table.held_out;
  same.highest_hz = table.highest_hz;
  same.highest_law_hz = table.highest_law_hz;
  same.reversals = table.reversals;
  same.not_visible = table.not_visible;
  return same;
}

}  // namespace

ChosenColumns choose_columns(const RegressorTable& table, const std::vector<int>& terms, bool presliding) {
  ChosenColumns chosen{without_columns(table), {}, {}};
  const auto keep = [&](Eigen::Index column) {
    chosen.columns.push_back(column);
    return std::ssize(chosen.columns) - 1;
  };
  for (Eigen::Index j = 0; j < table.model_columns; ++j) keep(j);
  for (const int t : terms) {
    chosen.table.terms.push_back(table.terms[static_cast<std::size_t>(t)]);
    for (Eigen::Index& column : chosen.table.terms.back().columns) column = keep(column);
  }
  for (const Eigen::Index column : table.differences) chosen.table.differences.push_back(keep(column));
  chosen.table.scale = table.scale(chosen.columns);
  chosen.table.columns.resize(0, std::ssize(chosen.columns));
  if (!presliding || !table.presliding) return chosen;
  std::vector<Eigen::Index> place(static_cast<std::size_t>(table.columns.cols()), -1);
  for (std::size_t i = 0; i < chosen.columns.size(); ++i)
    place[static_cast<std::size_t>(chosen.columns[i])] = static_cast<Eigen::Index>(i);
  PreslidingColumns& own = chosen.table.presliding.emplace();
  for (std::size_t i = 0; i < table.presliding->instead_of.size(); ++i) {
    const Eigen::Index at = place[static_cast<std::size_t>(table.presliding->instead_of[i])];
    if (at < 0) continue;
    own.instead_of.push_back(at);
    chosen.presliding.push_back(static_cast<Eigen::Index>(i));
  }
  for (auto i = std::ssize(table.presliding->instead_of); i < table.presliding->columns.cols(); ++i)
    chosen.presliding.push_back(i);
  own.columns.resize(0, std::ssize(chosen.presliding));
  return chosen;
}

ChosenColumns all_columns(const RegressorTable& table) {
  ChosenColumns all{without_columns(table), {}, {}};
  all.table.terms = table.terms;
  all.table.differences = table.differences;
  all.table.scale = table.scale;
  all.table.columns.resize(0, table.columns.cols());
  all.columns.resize(static_cast<std::size_t>(table.columns.cols()));
  std::iota(all.columns.begin(), all.columns.end(), Eigen::Index{0});
  if (!table.presliding) return all;
  all.presliding.resize(static_cast<std::size_t>(table.presliding->columns.cols()));
  std::iota(all.presliding.begin(), all.presliding.end(), Eigen::Index{0});
  all.table.presliding = PreslidingColumns{table.presliding->instead_of, {}, {}};
  all.table.presliding->columns.resize(0, table.presliding->columns.cols());
  return all;
}

RegressorTable make_regressor_table(const PreparedData& prepared, Balance balance, const Terms& terms,
                                    const std::optional<PreslidingTravels>& travels, double highest_law_hz,
                                    const SelectionPolicy& policy) {
  DirectedData sign(prepared, balance, [](const Record& r) { return expected_sign(r); });
  std::optional<DirectedData> presliding;
  if (travels)
    presliding.emplace(prepared, balance, [&](const Record& r) { return presliding_state(r, travels->state); });
  RegressorTable table;
  table.records = prepared.records.size();
  for (const Record& r : prepared.records) table.held_out.push_back(r.experiment->role == data::Role::holdout ? 1 : 0);
  table.highest_hz = prepared.pipeline.row_cutoff_hz;
  table.highest_law_hz = highest_law_hz;
  add_runs(sign.data, table);
  TableBuilder builder{sign, presliding ? &*presliding : nullptr, terms, policy, table, {}, {}, {}};
  if (!add_model_columns(builder)) return table;
  const Motion motion = motion_of(prepared);
  add_row_signals(builder);
  add_catalogue_terms(builder, motion);
  add_generic_curves(builder, motion);
  if (travels) add_presliding_shape(builder, *travels);
  add_other_travels(builder);
  add_differences(builder);
  scale_columns(builder);
  return table;
}

}  // namespace flexspline::selection
