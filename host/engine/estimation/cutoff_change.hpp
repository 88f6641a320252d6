// What the choice of the cut-off does to estimates.
#pragma once

#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::estimation {

// The bias that the filters leave, by estimate. A filter rounds what is short (reversals, a law of slow motion), which
// a higher cut-off does less, with more noise: so the model is fitted again at twice the cut-off, and the change, which
// the estimate keeps, is compared with what noise explains of it, the difference of the two variances (Hausman 1978).
// The rest is taken for the bias. What both cut-offs have in common it does not show. Zero where the data do not allow
// twice the cut-off.
std::vector<double> bias_of_cutoff(Identification& identification, const data::Dataset& dataset,
                                   const model::Model& model, const PipelineOptions& pipeline);

}  // namespace flexspline::estimation
