// Names as `add` would fit them: with the biases of filters and noise, which the search by likelihood leaves out.
#pragma once

#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

// Fits the model with all named effects as `add` does, and takes back each linear one of which every parameter's 95 %
// interval holds zero. Those that held-out experiments confirm stay, and so do a confusable group and effects with a
// nonlinear parameter, which is none where the effect is zero (Davies 1977). Nothing is fitted where no name is left to
// judge.
void take_back_where_refit_holds_zero(const data::Dataset& dataset, const model::Model& model,
                                      const estimation::PipelineOptions& pipeline, Diagnosis& result);

}  // namespace flexspline::selection
