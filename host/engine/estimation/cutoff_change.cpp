#include "host/engine/estimation/cutoff_change.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

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

}  // namespace

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

}  // namespace flexspline::estimation
