#include "host/engine/comparison/sample_variables.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "host/input/data/record_time.hpp"

namespace flexspline::comparison {
namespace {

using data::Column;
using estimation::Balance;
using estimation::Record;
using estimation::RegressionProblem;

// Friction changes by some 2 % per degree.
constexpr double kNarrowestTemperature_c = 1.0;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

template <class Value>
Eigen::VectorXd along_rows(const RegressionProblem& data, Value value) {
  Eigen::VectorXd rows(data.rows());
  for (const estimation::RowRange& range : data.records()) {
    const Record& record = data.prepared().records[range.record];
    const std::vector<std::size_t>& samples = record.rows[estimation::index(data.balance())].samples;
    for (Eigen::Index k = range.first; k < range.last; ++k)
      rows[k] = value(record, samples[static_cast<std::size_t>(k - range.first)]);
  }
  return rows;
}

// Travel since the direction variable last changed its sign; NaN before the first change.
std::vector<double> travel_of(const Record& record, Balance balance) {
  std::vector<double> travel(record.inputs.size(), kNone);
  for (const data::Segment& s : record.segments)
    for (std::size_t k = s.first + 1; k < s.last; ++k) {
      const double v = record.direction_variable(balance, k), before = record.direction_variable(balance, k - 1);
      travel[k] = v * before < 0.0 ? 0.0 : travel[k - 1] + record.sample_s * std::abs(v);
    }
  return travel;
}

bool varies(const Eigen::VectorXd& values) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double x : values)
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  return high > low;
}

}  // namespace

std::vector<SampleVariable> sample_variables(const RegressionProblem& data, data::Axis axis) {
  const estimation::PreparedData& prepared = data.prepared();
  const Balance balance = data.balance();
  const bool on_load = balance == Balance::load;
  const double turns = prepared.constants.turn_angle_scale;
  const std::string position = data::unit_of(Column::motor_position, axis);
  const std::string velocity = data::unit_of(Column::motor_velocity, axis);
  std::vector<SampleVariable> variables;
  const auto add = [&](const char* name, std::string unit, auto value) {
    Eigen::VectorXd rows = along_rows(data, value);
    if (varies(rows)) variables.push_back({name, std::move(unit), std::move(rows)});
  };
  const auto speed_of = [&](const Record& r, std::size_t k) {
    return on_load ? r.inputs.output_velocity_at(k) : r.inputs.velocity_at(k);
  };
  add("velocity", velocity, speed_of);
  add("speed", velocity, [&](const Record& r, std::size_t k) { return std::abs(speed_of(r, k)); });
  add("acceleration", velocity + "^2", [&](const Record& r, std::size_t k) {
    return on_load ? r.inputs.at(k, effects::kOutputMotion).output_acceleration
                   : r.inputs.at(k, effects::kMotorMotion).acceleration;
  });
  if (axis == data::Axis::rotary || turns != 1.0)
    add("motor_angle", "rad", [&](const Record& r, std::size_t k) {
      if (!r.has_motor_motion) return kNone;
      const double angle = std::remainder(r.inputs.angle_at(k) * turns, 2.0 * M_PI);
      return angle < 0.0 ? angle + 2.0 * M_PI : angle;
    });
  // A free output without a sensor follows the motor.
  add("output_angle", position,
      [&](const Record& r, std::size_t k) { return r.locked ? kNone : r.inputs.output_angle_at(k); });
  add("current", "A",
      [&](const Record& r, std::size_t k) { return r.experiment->has(Column::current) ? r.inputs.current[k] : kNone; });
  add("torque", data::unit_of(Column::torque, axis),
      [&](const Record& r, std::size_t k) { return r.torque.empty() ? kNone : r.inputs.torque_at(k); });
  const auto has_torsion = [](const Record& r) { return r.has_motor_motion && r.has_output_motion; };
  add("torsion", position,
      [&](const Record& r, std::size_t k) { return has_torsion(r) ? r.inputs.torsion_at(k) : kNone; });
  if (balance == Balance::transmission)
    add("torsion_rate", velocity,
        [&](const Record& r, std::size_t k) { return has_torsion(r) ? r.inputs.torsion_rate_at(k) : kNone; });
  add("temperature", "degC",
      [&](const Record& r, std::size_t k) { return r.has_temperature ? r.inputs.temperature_at(k) : kNone; });
  if (!variables.empty() && variables.back().name == "temperature")
    variables.back().narrowest_bin = kNarrowestTemperature_c;
  add("time", "s",
      [&](const Record& r, std::size_t k) { return r.experiment->time_s[k] - data::start_of_times(*r.experiment); });
  const Record* travelled = nullptr;
  std::vector<double> travel;
  add("travel", position, [&](const Record& r, std::size_t k) {
    if (travelled != &r) {
      travel = travel_of(r, balance);
      travelled = &r;
    }
    return travel[k];
  });
  return variables;
}

Eigen::VectorXd sample_directions(const RegressionProblem& data) {
  return along_rows(data, [&](const Record& r, std::size_t k) {
    const double v = r.direction_variable(data.balance(), k);
    return r.at_rest || v == 0.0 ? kNone : v > 0.0 ? 1.0 : -1.0;
  });
}

Bins equal_count_bins(const Eigen::VectorXd& values, std::size_t wanted, double narrowest) {
  Bins bins;
  bins.bin.assign(static_cast<std::size_t>(values.size()), -1);
  std::vector<double> sorted;
  for (const double x : values)
    if (std::isfinite(x)) sorted.push_back(x);
  if (sorted.empty() || wanted == 0) return bins;
  std::sort(sorted.begin(), sorted.end());
  if (narrowest > 0.0 && sorted.back() - sorted.front() < 2.0 * narrowest) return bins;
  std::vector<double> edges{sorted.front()};
  for (std::size_t b = 1; b < wanted; ++b) {
    const double edge = sorted[b * sorted.size() / wanted];
    if (edge > edges.back() && edge - edges.back() >= narrowest) edges.push_back(edge);
  }
  while (edges.size() > 1 && sorted.back() - edges.back() < narrowest) edges.pop_back();
  if (sorted.back() > edges.back())
    edges.push_back(sorted.back());
  else if (edges.size() < 3)
    return bins;
  bins.edges = edges;
  for (std::size_t k = 0; k < bins.bin.size(); ++k) {
    const double x = values[static_cast<Eigen::Index>(k)];
    if (!std::isfinite(x)) continue;
    const auto above = std::upper_bound(edges.begin(), edges.end(), x) - edges.begin();
    bins.bin[k] = static_cast<int>(std::min<std::ptrdiff_t>(above, static_cast<std::ptrdiff_t>(edges.size()) - 1)) - 1;
  }
  return bins;
}

}  // namespace flexspline::comparison
