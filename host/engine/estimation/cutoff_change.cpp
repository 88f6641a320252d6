#include "host/engine/estimation/cutoff_change.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "host/common/numbers/distributions.hpp"
#include "host/input/data/finding.hpp"

namespace flexspline::estimation {
namespace {

constexpr double kHigherCutoff = 2.0;

std::unique_ptr<Identification> at_higher_cutoff(const Identification& found, const data::Dataset& dataset,
                                                 const model::Model& model, const PipelineOptions& pipeline) {
  PipelineOptions higher = pipeline;
  higher.cutoff_hz = kHigherCutoff * found.prepared.pipeline.row_cutoff_hz;
  higher.mask = found.prepared.pipeline.mask;
  higher.ready = nullptr;
  try {
    return identify(dataset, model, higher);
  } catch (const data::DataError&) {
    return nullptr;  // sampled too slowly for that
  }
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

void widen_by_cutoff(Identification& identification, const data::Dataset& dataset, const model::Model& model,
                     const PipelineOptions& pipeline) {
  const auto higher = at_higher_cutoff(identification, dataset, model, pipeline);
  if (!higher) return;
  for (Estimate& e : identification.estimates) {
    const auto other = std::find_if(higher->estimates.begin(), higher->estimates.end(),
                                    [&](const Estimate& o) { return o.ref == e.ref; });
    if (e.fixed || !e.std || !(*e.std > 0.0) || !e.low || !e.high) continue;
    if (other == higher->estimates.end() || !other->identifiable || !other->std) continue;
    e.change_at_twice_cutoff = other->value - e.value;
    const double of_noise = std::abs(*other->std * *other->std - *e.std * *e.std);
    const double squared = *e.change_at_twice_cutoff * *e.change_at_twice_cutoff - of_noise;
    if (squared <= 0.0) continue;
    const double half = half_width_under_bias(std::sqrt(squared) / *e.std) * *e.std;
    e.low = std::min(*e.low, e.value - half);
    e.high = std::max(*e.high, e.value + half);
  }
}

}  // namespace flexspline::estimation
