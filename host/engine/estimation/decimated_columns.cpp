// Columns from fewer samples, for searches over many nonlinear parameters.
#include <algorithm>
#include <cmath>

#include "host/engine/estimation/regressor_evaluator.hpp"

namespace flexspline::estimation {
namespace {

// Samples of the decimated signals for each sample of the target. The target has four for a period of the cut-off, so
// what moves the columns (positions are filtered at 2.5 times it) stays below the Nyquist frequency of twice that rate.
constexpr std::size_t kSamplesPerRow = 2;

}  // namespace

RegressorEvaluator RegressorEvaluator::decimated() const {
  auto made = std::make_shared<PreparedData>();
  PreparedData& few = *made;
  few.pipeline = prepared_->pipeline;
  few.constants = prepared_->constants;
  few.drive = prepared_->drive;
  few.output_signals = prepared_->output_signals;
  few.effort_is_current = prepared_->effort_is_current;
  few.nonlinear_in_measured_current = prepared_->nonlinear_in_measured_current;
  few.rotary = prepared_->rotary;
  few.records.resize(prepared_->records.size());
  RegressorEvaluator thin = *this;
  thin.prepared_ = made.get();
  thin.decimated_ = std::move(made);
  thin.beyond_.assign(static_cast<std::size_t>(rows()), 0.0);
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    const Record& r = prepared_->records[ranges_[i].record];
    Record& f = few.records[ranges_[i].record];
    const std::size_t step = std::max<std::size_t>(1, r.decimation / kSamplesPerRow);
    f.experiment = r.experiment;
    f.name = r.name;
    f.locked = r.locked;
    f.at_rest = r.at_rest;
    f.sample_s = r.sample_s * static_cast<double>(step);
    f.decimation = std::min(kSamplesPerRow, r.decimation);
    f.has_motor_motion = r.has_motor_motion;
    f.has_output_motion = r.has_output_motion;
    f.has_temperature = r.has_temperature;
    f.velocity_noise = r.velocity_noise;
    const auto& samples = r.rows[index(balance_)].samples;
    auto& taken = f.rows[index(balance_)].samples;
    auto row = static_cast<std::size_t>(ranges_[i].first);
    std::size_t next = 0;
    f.inputs = r.inputs.every(step);
    f.segments = f.inputs.segments;
    for (std::size_t at_segment = 0; at_segment < r.segments.size(); ++at_segment) {
      const data::Segment& s = r.segments[at_segment];
      const std::size_t first = f.segments[at_segment].first, last = f.segments[at_segment].last - 1;
      for (; next < samples.size() && samples[next] < s.last; ++next, ++row) {
        // Interpolation takes a sample before and two behind; at the ends of a segment the nearest one serves.
        const std::size_t at = first + (samples[next] - s.first) / step;
        const std::size_t over = (samples[next] - s.first) % step;
        const bool inside = at > first && at + 2 <= last;
        taken.push_back(inside || 2 * over < step ? at : std::min(at + 1, last));
        if (inside) thin.beyond_[row] = static_cast<double>(over) / static_cast<double>(step);
      }
    }
    const double sample_hz = 1.0 / f.sample_s;
    thin.filters_[i] = signals::ZeroPhaseFilter(signals::ZeroPhaseFilter::kDefaultOrder,
                                                std::min(filters_[i].cutoff_hz(), 0.45 * sample_hz), sample_hz);
  }
  return thin;
}

}  // namespace flexspline::estimation
