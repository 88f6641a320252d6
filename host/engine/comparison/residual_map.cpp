#include "host/engine/comparison/residual_map.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>

#include "host/common/algebra/decompositions.hpp"
#include "host/common/numbers/distributions.hpp"
#include "host/engine/comparison/sample_variables.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/least_squares.hpp"

namespace flexspline::comparison {
namespace {

using estimation::RegressionProblem;
using estimation::RowRange;

constexpr double kSignificant = 1e-3;
constexpr int kOrders = 24;
constexpr double kWholeWaves = 2.0;
constexpr std::size_t kMostMapBins = 24;
constexpr std::size_t kRowsPerMapBin = 16;

// A map or wave: what it predicts in each sample (zero where it predicts nothing), and its number of parameters in
// addition to the mean.
struct Explained {
  Eigen::VectorXd prediction;
  std::vector<RowRange> records;  // in which it predicts something
  double parameters = 0.0;
  double rows = 0.0;       // in which it predicts something
  double explained = 0.0;  // sum of squares, of the samples in which it predicts something
  double total = 0.0;      // likewise, about the mean
  double all = 0.0;        // of all samples, about the mean
};

// Adjusted share of the whole residual's variance, where it is significant. The number of independent samples follows
// from the autocorrelation of what the map leaves, not of the residual itself, which contains the structure.
std::optional<double> significant_share(const Eigen::VectorXd& residual, const Explained& e, double longest_tau,
                                        double level) {
  if (!(e.total > 0.0) || e.parameters < 1.0) return std::nullopt;
  const double r2 = std::clamp(e.explained / e.total, 0.0, 1.0 - 1e-12);
  // A map that explains less than this with one degree of freedom for each number is not significant under any
  // autocorrelation.
  if (r2 * e.rows < e.parameters) return std::nullopt;
  const double tau = std::clamp(estimation::autocorrelation_time(e.records, residual - e.prediction), 1.0, longest_tau);
  const double independent = e.rows / tau, freedom = independent - 1.0 - e.parameters;
  if (freedom < 4.0) return std::nullopt;
  const double f = (r2 / e.parameters) / ((1.0 - r2) / freedom);
  if (numbers::fisher_f_above(e.parameters, freedom, f) > level) return std::nullopt;
  const double adjusted = 1.0 - (1.0 - r2) * (independent - 1.0) / freedom;
  if (!(adjusted > 0.0) || !(e.all > 0.0)) return std::nullopt;
  return adjusted * std::min(1.0, e.total / e.all);
}

// A step function over the bins, of the residual or, with `directions`, of the residual times the direction.
Explained map_of(const RegressionProblem& data, const Bins& bins, const Eigen::VectorXd& residual,
                 const Eigen::VectorXd* directions) {
  Explained e;
  e.records = data.records();
  e.prediction = Eigen::VectorXd::Zero(residual.size());
  std::vector<double> sum(bins.count(), 0.0), count(bins.count(), 0.0);
  const auto sign = [&](Eigen::Index k) { return directions ? (*directions)[k] : 1.0; };
  const auto bin = [&](Eigen::Index k) { return std::isfinite(sign(k)) ? bins.bin[static_cast<std::size_t>(k)] : -1; };
  double all = 0.0, squares = 0.0, with_sign = 0.0, signed_sum = 0.0;
  for (Eigen::Index k = 0; k < residual.size(); ++k) {
    if (!std::isfinite(sign(k))) continue;
    e.all += residual[k] * residual[k];
    signed_sum += residual[k] * sign(k);
    with_sign += 1.0;
    if (bin(k) < 0) continue;
    const auto b = static_cast<std::size_t>(bin(k));
    sum[b] += residual[k] * sign(k);
    count[b] += 1.0;
    all += residual[k] * sign(k);
    squares += residual[k] * residual[k];
    e.rows += 1.0;
  }
  if (e.rows < 16.0) return e;
  e.all -= signed_sum * signed_sum / with_sign;
  e.explained = -all * all / e.rows;
  e.total = squares + e.explained;
  e.parameters = -1.0;
  for (std::size_t b = 0; b < sum.size(); ++b)
    if (count[b] > 0.0) {
      e.explained += sum[b] * sum[b] / count[b];
      e.parameters += 1.0;
    }
  for (Eigen::Index k = 0; k < residual.size(); ++k)
    if (bin(k) >= 0)
      e.prediction[k] = sign(k) * sum[static_cast<std::size_t>(bin(k))] / count[static_cast<std::size_t>(bin(k))];
  return e;
}

Bins record_bins(const RegressionProblem& data) {
  Bins bins;
  bins.bin.assign(static_cast<std::size_t>(data.rows()), -1);
  for (std::size_t r = 0; r < data.records().size(); ++r)
    for (Eigen::Index k = data.records()[r].first; k < data.records()[r].last; ++k)
      bins.bin[static_cast<std::size_t>(k)] = static_cast<int>(r);
  for (std::size_t r = 0; r <= data.records().size(); ++r) bins.edges.push_back(static_cast<double>(r));
  return bins;
}

Bins direction_bins(const Eigen::VectorXd& directions) {
  Bins bins;
  bins.edges = {-1.0, 0.0, 1.0};
  for (const double d : directions) bins.bin.push_back(!std::isfinite(d) ? -1 : d < 0.0 ? 0 : 1);
  return bins;
}

// A wave of the motor's turn after the filter, which removes high orders at speed. The zero of an angle
// that is not absolute differs from record to record, so each record has a phase of its own then. Records with less
// than a few whole waves are left out: a part of a wave resembles any smooth curve.
Explained wave_of(const RegressionProblem& data, const Eigen::VectorXd& residual, int order) {
  const auto& prepared = data.prepared();
  const auto balance = estimation::index(data.balance());
  const double per_unit = static_cast<double>(order) * prepared.constants.turn_angle_scale;
  struct Group {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d y = Eigen::Vector3d::Zero();
    double squares = 0.0;
    std::vector<RowRange> ranges;
  };
  bool absolute = true;
  for (const RowRange& range : data.records())
    absolute = absolute && prepared.records[range.record].experiment->motor_position_zero != data::PositionZero::none;
  Eigen::MatrixX3d x = Eigen::MatrixX3d::Zero(data.rows(), 3);
  std::vector<Group> groups;
  for (const RowRange& range : data.records()) {
    const auto& record = prepared.records[range.record];
    if (!record.has_motor_motion) continue;
    const auto& samples = record.rows[balance].samples;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (Eigen::Index k = range.first; k < range.last; ++k) {
      const std::size_t sample = samples[static_cast<std::size_t>(k - range.first)];
      const double wave = per_unit * record.inputs.angle_at(sample);
      const double frequency_hz = std::abs(per_unit * record.inputs.velocity_at(sample)) / (2.0 * M_PI);
      const double gain = 1.0 / (1.0 + std::pow(frequency_hz / prepared.pipeline.row_cutoff_hz,
                                                2.0 * static_cast<double>(signals::ZeroPhaseFilter::kDefaultOrder)));
      low = std::min(low, wave);
      high = std::max(high, wave);
      x.row(k) << 1.0, gain * std::cos(wave), gain * std::sin(wave);
    }
    if (high - low < kWholeWaves * 2.0 * M_PI) continue;
    if (!absolute || groups.empty()) groups.emplace_back();
    Group& group = groups.back();
    const auto part = x.middleRows(range.first, range.size());
    const auto y = residual.segment(range.first, range.size());
    group.normal += part.transpose() * part;
    group.y += part.transpose() * y;
    group.squares += y.squaredNorm();
    group.ranges.push_back(range);
  }
  Explained e;
  e.all = (residual.array() - residual.mean()).square().sum();
  e.prediction = Eigen::VectorXd::Zero(residual.size());
  for (const Group& group : groups) {
    const Eigen::Vector3d theta = algebra::PivotedQr(group.normal).solve(group.y);
    const double mean_part = group.y[0] * group.y[0] / group.normal(0, 0);
    e.explained += group.y.dot(theta) - mean_part;
    e.total += group.squares - mean_part;
    e.rows += group.normal(0, 0);
    e.parameters += 2.0;
    e.records.insert(e.records.end(), group.ranges.begin(), group.ranges.end());
    for (const RowRange& range : group.ranges)
      e.prediction.segment(range.first, range.size()) = x.middleRows(range.first, range.size()) * theta;
  }
  return e;
}

}  // namespace

std::vector<Share> localise(const RegressionProblem& data, const Eigen::VectorXd& residual, double autocorrelation_time,
                            data::Axis axis) {
  if (residual.size() != data.rows() || residual.size() < 16) return {};
  const double tau = std::max(1.0, autocorrelation_time);
  const auto wanted =
      std::clamp<std::size_t>(static_cast<std::size_t>(residual.size()) / kRowsPerMapBin, 4, kMostMapBins);
  const Eigen::VectorXd directions = sample_directions(data);
  // One test each; on all cores, with results in this order.
  std::vector<std::function<std::vector<Share>()>> questions;
  const auto share_of = [&](std::vector<Share>& shares, std::string name, const Explained& explained, double level) {
    if (const auto share = significant_share(residual, explained, tau, level))
      shares.push_back({std::move(name), 100.0 * *share});
  };
  const auto maps_of = [&](const std::string& name, const Bins& bins) {
    std::vector<Share> shares;
    share_of(shares, name, map_of(data, bins, residual, nullptr), kSignificant);
    share_of(shares, name + " x direction", map_of(data, bins, residual, &directions), kSignificant);
    return shares;
  };
  const std::vector<SampleVariable> variables = sample_variables(data, axis);
  for (const SampleVariable& variable : variables)
    questions.emplace_back([&] { return maps_of(variable.name, equal_count_bins(variable.values, wanted)); });
  questions.emplace_back([&] {
    std::vector<Share> shares;
    share_of(shares, "direction", map_of(data, direction_bins(directions), residual, nullptr), kSignificant);
    return shares;
  });
  if (data.records().size() > 1) questions.emplace_back([&] { return maps_of("record", record_bins(data)); });
  // A linear axis has a turn only where its pitch is known.
  const bool turns = axis == data::Axis::rotary || data.prepared().constants.turn_angle_scale != 1.0;
  for (int order = 1; turns && order <= kOrders; ++order)
    questions.emplace_back([&, order] {
      std::vector<Share> shares;
      share_of(shares, fmt::format("motor_angle order {}", order), wave_of(data, residual, order),
               kSignificant / kOrders);
      return shares;
    });
  std::vector<std::vector<Share>> answers(questions.size());
  estimation::in_parallel(questions.size(), [&](std::size_t i) { answers[i] = questions[i](); });
  std::vector<Share> shares;
  for (std::vector<Share>& answer : answers) std::ranges::move(answer, std::back_inserter(shares));
  std::stable_sort(shares.begin(), shares.end(),
                   [](const Share& a, const Share& b) { return a.share_percent > b.share_percent; });
  return shares;
}

}  // namespace flexspline::comparison
