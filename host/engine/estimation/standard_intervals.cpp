#include "host/engine/estimation/standard_intervals.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "host/common/numbers/distributions.hpp"
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

// What the measured signals do to one estimate: its bias, and the variance that its standard error has not counted.
struct OfSignals {
  double bias = 0.0, variance = 0.0;
};
OfSignals of_signals(const Identification& found, const std::vector<RegressorNoise>& noise,
                     const std::vector<Eigen::VectorXd>& of_held_step, const ParameterRef& ref) {
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
    return {size(noise[b].bias) + size(of_held_step[b]),
            std::max(variance(noise[b].chance) - variance(noise[b].counted), 0.0)};
  }
  return {};
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
  const std::vector<RegressorNoise> noise = regressor_noise(found);
  const std::vector<Eigen::VectorXd> of_held_step = change_by_held_step(found);
  for (std::size_t i = 0; i < found.estimates.size(); ++i) {
    Estimate& e = found.estimates[i];
    if (e.fixed || !e.std || !e.low || !e.high) continue;
    const OfSignals of_columns = of_signals(found, noise, of_held_step, e.ref);
    e.std = std::hypot(*e.std, std::sqrt(of_columns.variance));
    const Interval wider = interval_95(e.value, *e.std, of_filters[i] + of_columns.bias);
    e.low = std::min(*e.low, wider.low);
    e.high = std::max(*e.high, wider.high);
  }
  store(found.model, found.estimates);
}

}  // namespace flexspline::estimation
