// Rows of a balance and its measured left side.
#include <fmt/format.h>

#include <algorithm>

#include "host/common/signals/differentiate.hpp"
#include "host/engine/estimation/filtered_columns.hpp"
#include "host/engine/estimation/regressor_evaluator.hpp"

namespace flexspline::estimation {

bool RegressorEvaluator::usable(const Record& r) const {
  switch (balance_) {
    case Balance::motor:
      return !r.effort.empty() && r.has_motor_motion && (!prepared_->output_signals.torque || !r.torque.empty());
    case Balance::transmission:
      return !r.torque.empty() && r.has_motor_motion && r.has_output_motion && !r.at_rest;
    case Balance::load:
      return !r.torque.empty() && !r.locked && (r.has_output_motion || r.has_motor_motion) && !r.at_rest;
  }
  return false;
}

namespace {

// Left sides of a balance and negative slopes of what may come late in them, along a record, for
// RegressorEvaluator::filtered_columns.
class LeftHandSides {
 public:
  LeftHandSides(const PreparedData& prepared, Balance balance) : prepared_(prepared), balance_(balance) {}

  unsigned reads(std::size_t) const { return 0; }
  void operator()(const RowRange& range, std::size_t column, const ColumnBlock& block) {
    const Record& r = prepared_.records[range.record];
    if (column == 0)
      fill_target(r, block.first, block.signal);
    else
      fill_delay(r, block.first, block.signal);
  }

 private:
  double left_side(const Record& r, std::size_t k) const {
    switch (balance_) {
      case Balance::motor:
        if (r.at_rest) return r.effort[k];  // friction holds the torque of the gear
        return r.effort[k] - (prepared_.output_signals.torque ? r.torque[k] / prepared_.constants.gear_ratio : 0.0);
      case Balance::transmission:
        return r.torque[k];
      case Balance::load:
        return r.torque[k] - (r.load_torque.empty() ? 0.0 : r.load_torque[k]);
    }
    return 0.0;
  }
  void fill_target(const Record& r, std::size_t from, std::span<double> signal) const {
    for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = left_side(r, from + k);
    // A known load torque reaches the motor through the gear.
    if (balance_ == Balance::motor && !prepared_.output_signals.torque && !r.load_torque.empty() && !r.at_rest)
      for (std::size_t k = 0; k < signal.size(); ++k)
        signal[k] -= r.load_torque[from + k] / prepared_.constants.gear_ratio;
  }
  // What may come late: the motor's effort, and not the torque of the gear that is measured beside it.
  void fill_late(const Record& r, std::size_t from, std::span<double> signal) const {
    if (balance_ != Balance::motor) return fill_target(r, from, signal);
    for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = r.effort[from + k];
  }
  void fill_delay(const Record& r, std::size_t from, std::span<double> signal) {
    const std::size_t end = from + signal.size();
    for (const data::Segment& s : r.segments) {
      const std::size_t begin = std::max(from, s.first), last = std::min(end, s.last);
      if (begin >= last) continue;
      // With the neighbours that slopes need, at the ends of the segment two.
      const std::size_t before = std::min<std::size_t>(begin - s.first, 2);
      left_.resize(last - begin + before + std::min<std::size_t>(s.last - last, 2));
      slope_.resize(left_.size());
      fill_late(r, begin - before, left_);
      signals::central_derivative(left_, r.sample_s, slope_);
      for (std::size_t k = begin; k < last; ++k) signal[k - from] = -slope_[k - begin + before];
    }
  }

  const PreparedData& prepared_;
  Balance balance_;
  std::vector<double> left_, slope_;
};

}  // namespace

RegressorEvaluator::RegressorEvaluator(const PreparedData& prepared, Balance balance)
    : prepared_(&prepared), balance_(balance) {
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < prepared.records.size(); ++i) {
    const Record& r = prepared.records[i];
    const auto count = static_cast<Eigen::Index>(r.rows[index(balance)].samples.size());
    if (!usable(r)) continue;
    if (count < static_cast<Eigen::Index>(kFewestRows)) {
      left_out_.emplace(i, fmt::format("{} (of its {} samples {} are masked)", r.name,
                                       r.rows[index(balance)].masked + static_cast<std::size_t>(count),
                                       r.rows[index(balance)].masked));
      continue;
    }
    ranges_.push_back({i, first, first + count});
    filters_.emplace_back(signals::ZeroPhaseFilter::kDefaultOrder,
                          std::min(prepared.pipeline.row_cutoff_hz, 0.45 / r.sample_s), 1.0 / r.sample_s);
    first += count;
  }
}

Eigen::MatrixXd RegressorEvaluator::left_side() const {
  return filtered_columns(2, LeftHandSides(*prepared_, balance_));
}

double RegressorEvaluator::filter_autocorrelation_time() const {
  double longest = 1.0;
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    const Record& r = prepared_->records[ranges_[i].record];
    const double row_hz = 1.0 / (r.sample_s * static_cast<double>(r.decimation));
    constexpr int kFrequencies = 200;
    const double top_hz = std::min(3.0 * filters_[i].cutoff_hz(), 0.5 / r.sample_s);
    double bandwidth_hz = 0.0;
    for (int k = 0; k < kFrequencies; ++k) {
      const double gain = filters_[i].gain((k + 0.5) / kFrequencies * top_hz);
      bandwidth_hz += gain * gain * top_hz / kFrequencies;
    }
    longest = std::max(longest, row_hz / (2.0 * bandwidth_hz));
  }
  return longest;
}

}  // namespace flexspline::estimation
