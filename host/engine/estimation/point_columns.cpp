// Columns over a signal: what one unit at each point of a table adds, and waves of an angle.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/engine/estimation/filtered_columns.hpp"
#include "host/engine/estimation/regressor_evaluator.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::estimation {
namespace {

// A placeholder effect that reads what a table over the variable reads, so that it sees what shifts leave of it.
struct Reader {
  effects::Description info;
  catalogue::Entry entry;
  Term term;
  explicit Reader(effects::Variable variable) {
    for (const effects::VariableInfo& v : effects::kVariables)
      if (v.variable == variable) info.reads = v.reads;
    entry.info = &info;
    term.entry = &entry;
  }
};

double signal_of(const effects::Inputs<Real>& in, effects::Variable variable, double turn_angle_scale) {
  const auto within_turn = [](double angle) { return angle - kTurn * std::floor(angle / kTurn); };
  if (variable == effects::Variable::motor_angle) return within_turn(in.angle * turn_angle_scale);
  if (variable == effects::Variable::output_angle) return within_turn(in.output_angle);
  return effects::signal_of<Real>(variable, in);
}

// What effects::direction_on reads.
unsigned direction_reads(Balance balance) {
  return balance == Balance::motor          ? effects::kDirection
         : balance == Balance::transmission ? effects::kTorsion
                                            : effects::kOutputMotion;
}

// Between which points of the table a sample is, and how much it adds there.
struct Place {
  Eigen::Index point = 0;
  double share = 0.0, size = 0.0;
};

bool is_closed(const RegressorEvaluator::Points& points) {
  return points.variable == effects::Variable::motor_angle || points.variable == effects::Variable::output_angle;
}

std::vector<Place> places_of(const catalogue::PlainInputs& inputs, const RegressorEvaluator::Points& points,
                             double weight, double turn_angle_scale) {
  const bool closed = is_closed(points);
  const auto count = static_cast<Eigen::Index>(points.count);
  const double per_signal = closed ? static_cast<double>(count) / (2.0 * std::numbers::pi)
                                   : static_cast<double>(count - 1) / (points.high - points.low);
  std::vector<Place> places(inputs.size());
  inputs.each_block([&](std::size_t first, std::span<const effects::Inputs<Real>> block) {
    for (std::size_t k = 0; k < block.size(); ++k) {
      const effects::Inputs<Real>& in = block[k];
      const double x = signal_of(in, points.variable, turn_angle_scale);
      const double most = static_cast<double>(closed ? count : count - 1);
      const double at = std::clamp(closed ? x * per_signal : (x - points.low) * per_signal, 0.0, most);
      const auto point = std::min<Eigen::Index>(static_cast<Eigen::Index>(at), closed ? count - 1 : count - 2);
      places[first + k] = {point, at - static_cast<double>(point),
                           points.times_direction ? weight * effects::direction_on<Real>(points.balance, in) : weight};
    }
  });
  return places;
}

// By point, the samples that add to it.
std::vector<std::vector<std::size_t>> samples_by_point(const std::vector<Place>& places, std::size_t count) {
  std::vector<std::vector<std::size_t>> cross_columns(count);
  for (std::size_t k = 0; k < places.size(); ++k) {
    cross_columns[static_cast<std::size_t>(places[k].point)].push_back(k);
    cross_columns[static_cast<std::size_t>(places[k].point + 1) % count].push_back(k);
  }
  return cross_columns;
}

}  // namespace

Eigen::MatrixXd RegressorEvaluator::point_columns(const Terms& terms, const Points& points, bool filtered) const {
  const Reader reader(points.variable);
  const auto all = values_of_all(terms);
  const auto count = static_cast<Eigen::Index>(points.count);
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows(), count);
  for (const RowRange& range : ranges_) {
    const Record& r = prepared_->records[range.record];
    const double weight = r.at_rest ? 0.0 : share(r, points.balance);
    if (weight == 0.0) continue;
    std::vector<effects::Inputs<Real>> changed;
    const bool any = change_inputs<Real>(terms, reader.term, r, all, changed);
    const unsigned reads = reader.info.reads | (points.times_direction ? direction_reads(points.balance) : 0U);
    const std::vector<Place> places = places_of(any ? catalogue::PlainInputs(changed) : r.inputs.all(reads), points,
                                                weight, prepared_->constants.turn_angle_scale);
    const auto& samples = r.rows[index(balance_)].samples;
    if (!filtered) {
      for (std::size_t k = 0; k < samples.size(); ++k) {
        const Place& p = places[samples[k]];
        const Eigen::Index row = range.first + static_cast<Eigen::Index>(k);
        columns(row, p.point) += p.size * (1.0 - p.share);
        columns(row, (p.point + 1) % count) += p.size * p.share;
      }
      continue;
    }
    const std::vector<std::vector<std::size_t>> cross_columns = samples_by_point(places, points.count);
    std::vector<Eigen::Index> visited;
    for (Eigen::Index j = 0; j < count; ++j)
      if (!cross_columns[static_cast<std::size_t>(j)].empty()) visited.push_back(j);
    // Some at a time: together they would not stay in the cache.
    constexpr std::size_t kTogether = 8;
    for (std::size_t first = 0; first < visited.size(); first += kTogether) {
      const std::size_t many = std::min(kTogether, visited.size() - first);
      Eigen::MatrixXd signals =
          Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(places.size()), static_cast<Eigen::Index>(many));
      for (std::size_t i = 0; i < many; ++i) {
        const Eigen::Index j = visited[first + i];
        for (const std::size_t k : cross_columns[static_cast<std::size_t>(j)]) {
          const Place& p = places[k];
          signals(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) +=
              p.size * (p.point == j ? 1.0 - p.share : p.share);
        }
      }
      filter(range, signals);
      for (std::size_t i = 0; i < many; ++i)
        take_rows(range, signals.col(static_cast<Eigen::Index>(i)).data(),
                  columns.col(visited[first + i]).segment(range.first, range.size()));
    }
  }
  return columns;
}

Eigen::MatrixXd RegressorEvaluator::wave_columns(const Terms& terms, effects::Variable angle, Balance of,
                                                 int multiple) const {
  const Reader reader(angle);
  const auto all = values_of_all(terms);
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows(), 2);
  for (const RowRange& range : ranges_) {
    const Record& r = prepared_->records[range.record];
    const double weight = r.at_rest ? 0.0 : share(r, of);
    if (weight == 0.0) continue;
    std::vector<effects::Inputs<Real>> changed;
    const bool any = change_inputs<Real>(terms, reader.term, r, all, changed);
    Eigen::MatrixXd signals(static_cast<Eigen::Index>(r.inputs.size()), 2);
    const catalogue::PlainInputs inputs = any ? catalogue::PlainInputs(changed) : r.inputs.all(reader.info.reads);
    inputs.each_block([&](std::size_t first, std::span<const effects::Inputs<Real>> block) {
      for (std::size_t k = 0; k < block.size(); ++k) {
        const double x = multiple * signal_of(block[k], angle, prepared_->constants.turn_angle_scale);
        signals.row(static_cast<Eigen::Index>(first + k)) << weight * std::cos(x), weight * std::sin(x);
      }
    });
    filter(range, signals);
    for (Eigen::Index j = 0; j < 2; ++j)
      take_rows(range, signals.col(j).data(), columns.col(j).segment(range.first, range.size()));
  }
  return columns;
}

Eigen::VectorXd RegressorEvaluator::signal_at_rows(const Terms& terms, effects::Variable variable) const {
  const Reader reader(variable);
  const auto all = values_of_all(terms);
  Eigen::VectorXd signal(rows());
  for (const RowRange& range : ranges_) {
    const Record& r = prepared_->records[range.record];
    std::vector<effects::Inputs<Real>> changed;
    const bool any = change_inputs<Real>(terms, reader.term, r, all, changed);
    const auto& samples = r.rows[index(balance_)].samples;
    for (std::size_t k = 0; k < samples.size(); ++k)
      signal[range.first + static_cast<Eigen::Index>(k)] =
          signal_of(any ? changed[samples[k]] : r.inputs.at(samples[k], reader.info.reads), variable,
                    prepared_->constants.turn_angle_scale);
  }
  return signal;
}

}  // namespace flexspline::estimation
