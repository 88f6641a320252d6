// What the choice of the cut-off adds to an interval.
#pragma once

#include "host/engine/estimation/identify.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::estimation {

// Widens the 95 % intervals (not the standard errors) of a fit by least squares by the bias of its filters. A filter
// rounds what is short (reversals, a law of slow motion), which a higher cut-off does less, with more noise: so the
// model is fitted again at twice the cut-off, and the change is compared with what noise explains of it, the difference
// of the two variances (Hausman 1978). The rest is taken for the bias, and the interval is the one that holds 95 %
// under it (Armstrong and Kolesar 2018). What both cut-offs have in common it does not show. Nothing where the data do
// not allow twice the cut-off.
void widen_by_cutoff(Identification& identification, const data::Dataset& dataset, const model::Model& model,
                     const PipelineOptions& pipeline);

// Half the width, in standard errors, of an interval that holds 95 % of estimates with that bias, in standard errors.
double half_width_under_bias(double bias);

}  // namespace flexspline::estimation
