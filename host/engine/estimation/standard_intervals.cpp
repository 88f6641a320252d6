#include "host/engine/estimation/standard_intervals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/estimation/effort_timing.hpp"
#include "host/engine/estimation/regressor_noise.hpp"
#include "host/input/data/finding.hpp"

namespace flexspline::estimation {
namespace {

constexpr double kHigherCutoff = 2.0;

std::unique_ptr<Identification> at_higher_cutoff(const Identification& found, const data::Dataset& dataset,
                                                 const model::Model& model, const PipelineOptions& pipeline) {
  PipelineOptions higher = pipeline;
  higher.cutoff_hz = kHigherCutoff * found.prepared.pipeline.row_cutoff_hz;
  higher.mask = found.prepared.pipeline.mask;
  higher.keep_motor_reversals = found.prepared.pipeline.keep_motor_reversals;
  higher.ready = nullptr;
  try {
    return identify(dataset, model, higher);
  } catch (const data::DataError&) {
    return nullptr;  // sampled too slowly for that
  }
}

// The bias that the filters leave, by estimate. A filter rounds what is short (reversals, a law of slow motion), which
// a higher cut-off does less, with more noise: so the model is fitted again at twice the cut-off, and the change, which
// the estimate keeps, is compared with what noise explains of it, the difference of the two variances (Hausman 1978).
// The rest is taken for the bias. What both cut-offs have in common it does not show, nor that of the positions'
// filter, which is at 2.5 times the cut-off, and then at twice it. Zero where the data do not allow twice the cut-off.
std::vector<double> bias_of_cutoff(Identification& identification, const data::Dataset& dataset,
                                   const model::Model& model, const PipelineOptions& pipeline) {
  std::vector<double> bias(identification.estimates.size(), 0.0);
  const auto higher = at_higher_cutoff(identification, dataset, model, pipeline);
  for (std::size_t i = 0; higher && i < bias.size(); ++i) {
    Estimate& e = identification.estimates[i];
    const auto other = std::find_if(higher->estimates.begin(), higher->estimates.end(),
                                    [&](const Estimate& o) { return o.ref == e.ref; });
    if (e.fixed || !e.std || !(*e.std > 0.0)) continue;
    if (other == higher->estimates.end() || !other->identifiable || !other->std) continue;
    e.change_at_twice_cutoff = other->value - e.value;
    const double of_noise = std::abs(*other->std * *other->std - *e.std * *e.std);
    bias[i] = std::sqrt(std::max(*e.change_at_twice_cutoff * *e.change_at_twice_cutoff - of_noise, 0.0));
  }
  return bias;
}

// What the measured signals do to one estimate: biases by their noise and by their timing, and the variance that its
// standard error has not counted.
struct OfSignals {
  double noise_bias = 0.0, held_step_bias = 0.0, lag_bias = 0.0, variance = 0.0;
};

// What follows from the signals of all records, by balance.
struct SignalErrors {
  explicit SignalErrors(const Identification& found)
      : noise(regressor_noise(found)), held_step(change_by_held_step(found)), lag(effort_lag(found)) {}
  OfSignals of(const Identification& found, const ParameterRef& ref) const;

  std::vector<RegressorNoise> noise;
  std::vector<Eigen::VectorXd> held_step;
  std::optional<EffortLag> lag;
};

OfSignals SignalErrors::of(const Identification& found, const ParameterRef& ref) const {
  for (std::size_t b = 0; b < noise.size(); ++b) {
    std::vector<ParameterRef> all = found.fits[b].linear;
    all.insert(all.end(), found.fits[b].nonlinear.begin(), found.fits[b].nonlinear.end());
    if (std::ranges::find(all, ref) == all.end()) continue;
    const auto variance = [&](const Eigen::MatrixXd& covariance) {
      return natural_variance(found.terms[ref.term], ref, all, covariance);
    };
    const auto size = [&](const Eigen::VectorXd& change) {
      return std::sqrt(std::max(variance(change * change.transpose()), 0.0));
    };
    return {size(noise[b].bias), size(held_step[b]), lag ? size(lag->change[b]) : 0.0,
            std::max(variance(noise[b].chance) - variance(noise[b].counted), 0.0)};
  }
  return {};
}

// An effort that is taken for held is aligned by half a sample, by which a measured one then seems later.
std::string remedy_for(const Identification& found, const EffortLag& lag) {
  for (const Record& record : found.prepared.records) {
    const double half_s = 0.5 * record.sample_s;
    if (record.experiment->current_hold == data::CurrentHold::zoh && std::abs(lag.lag_s - half_s) < 0.5 * half_s)
      return fmt::format(
          "if it is measured, not a command that is held for a sample, state current_hold = none (a command is "
          "assumed, "
          "which is {:.2g} ms earlier); else correct the time of the column",
          1e3 * half_s);
  }
  return "correct the time of the column";
}

// `changed`: the estimate whose interval the lag widens most, by `bias`.
std::string late_effort(const Identification& found, const EffortLag& lag, const Estimate& changed, double bias) {
  return fmt::format(
      "the {} is {:.2g} ms {} than the motion (standard error {:.2g} ms), or the model lacks an effect that looks like "
      "it: {}.{} has an error of {:.2g} {} by that, which its interval counts; {}, or see `flexspline diagnose`",
      found.prepared.effort_is_current ? "current" : "motor torque", 1e3 * std::abs(lag.lag_s),
      lag.lag_s > 0.0 ? "later" : "earlier", 1e3 * lag.std_s, changed.id, changed.parameter, bias, changed.unit,
      remedy_for(found, lag));
}

}  // namespace

double half_width_under_bias(double bias) {
  constexpr double kInside = 0.95;
  const auto inside = [&](double half) {
    return numbers::normal_up_to(half - bias) - numbers::normal_up_to(-half - bias);
  };
  double low = 0.0, high = bias + 2.0;
  for (int i = 0; i < 60; ++i) (inside(0.5 * (low + high)) < kInside ? low : high) = 0.5 * (low + high);
  return high;
}

Interval interval_95(double value, double std, double bias) {
  const double half = std > 0.0 ? half_width_under_bias(std::abs(bias) / std) * std : std::abs(bias);
  return {value - half, value + half};
}

void count_biases(Identification& found, const data::Dataset& dataset, const model::Model& model,
                  const PipelineOptions& pipeline) {
  const std::vector<double> of_filters = bias_of_cutoff(found, dataset, model, pipeline);
  const SignalErrors signals(found);
  constexpr double kWorthSaying = 0.01;  // of the value
  const Estimate* most_changed = nullptr;
  double most_errors = half_width_under_bias(0.0), most_bias = 0.0;
  for (std::size_t i = 0; i < found.estimates.size(); ++i) {
    Estimate& e = found.estimates[i];
    if (e.fixed || !e.std || !e.low || !e.high) continue;
    const OfSignals own = signals.of(found, e.ref);
    e.std = std::hypot(*e.std, std::sqrt(own.variance));
    const Interval wider =
        interval_95(e.value, *e.std, of_filters[i] + own.noise_bias + own.held_step_bias + own.lag_bias);
    e.low = std::min(*e.low, wider.low);
    e.high = std::max(*e.high, wider.high);
    if (own.lag_bias > most_errors * *e.std && own.lag_bias > kWorthSaying * std::abs(e.value)) {
      most_changed = &e;
      most_errors = own.lag_bias / *e.std;
      most_bias = own.lag_bias;
    }
  }
  if (most_changed != nullptr && signals.lag->is_certain())
    found.warnings.push_back(late_effort(found, *signals.lag, *most_changed, most_bias));
  store(found.model, found.estimates);
}

}  // namespace flexspline::estimation
