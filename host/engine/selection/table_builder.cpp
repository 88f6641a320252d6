#include "host/engine/selection/table_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/common/numbers/quantile.hpp"
#include "host/common/signals/butterworth.hpp"

namespace flexspline::selection {

namespace {

estimation::PreparedData with_direction(
    estimation::PreparedData prepared, const std::function<std::vector<double>(const estimation::Record&)>& direction) {
  for (estimation::Record& r : prepared.records) r.inputs.directions[0] = direction(r);
  return prepared;
}

}  // namespace

DirectedData::DirectedData(const estimation::PreparedData& original, Balance balance,
                           const std::function<std::vector<double>(const estimation::Record&)>& direction)
    : prepared(with_direction(original, direction)), data(prepared, balance) {}

std::vector<std::size_t> TableBuilder::on_balance() const {
  return estimation::terms_on(terms, sign.data.balance(), sign.prepared.output_signals);
}

TableBuilder::DirectedColumns TableBuilder::directed_columns(const ColumnsOf& columns_of, bool reads_direction) const {
  return {columns_of(sign), presliding && reads_direction ? columns_of(*presliding) : Eigen::MatrixXd()};
}

std::vector<Eigen::Index> TableBuilder::add(DirectedColumns made) {
  std::vector<Eigen::Index> places;
  for (Eigen::Index j = 0; j < made.sign.cols(); ++j) {
    places.push_back(std::ssize(columns));
    columns.emplace_back(made.sign.col(j));
    if (made.presliding.cols() == 0) continue;
    table.presliding->instead_of.push_back(places.back());
    presliding_columns.emplace_back(made.presliding.col(j));
  }
  return places;
}

Eigen::MatrixXd TableBuilder::filtered(Eigen::MatrixXd rows) const {
  for (const Run& run : table.runs) {
    const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                          std::min(table.highest_hz, 0.45 / run.row_s), 1.0 / run.row_s);
    filter.apply_columns_in_place(rows.middleRows(run.first, run.last - run.first));
  }
  return rows;
}

Motion motion_of(const estimation::PreparedData& prepared) {
  Motion motion;
  std::vector<double> speeds;
  for (const estimation::Record& r : prepared.records)
    for (std::size_t k = 1; k < r.inputs.size() && !r.inputs.angle.empty(); ++k) {
      motion.travel += std::abs(r.inputs.angle_at(k) - r.inputs.angle_at(k - 1));
      if (k % r.decimation == 0) speeds.push_back(std::abs(r.inputs.velocity_at(k)));
    }
  motion.turn = 2.0 * std::numbers::pi / prepared.constants.turn_angle_scale;
  motion.typical_speed = numbers::quantile(speeds, 0.5);
  motion.top_speed = numbers::quantile(speeds, 0.95);
  return motion;
}

Eigen::VectorXd slope_of(const Eigen::VectorXd& column, const std::vector<Run>& runs) {
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(column.size());
  for (const Run& run : runs)
    for (Eigen::Index k = run.first; k < run.last; ++k) {
      const Eigen::Index a = std::max(run.first, k - 1), b = std::min(run.last - 1, k + 1);
      slope[k] = (column[b] - column[a]) / (static_cast<double>(b - a) * run.row_s);
    }
  return slope;
}

}  // namespace flexspline::selection
