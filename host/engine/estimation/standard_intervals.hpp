// The 95 % intervals that all commands give.
#pragma once

#include "host/engine/estimation/identify.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::estimation {

// Half the width, in standard errors, of an interval that holds 95 % of estimates with that bias, in standard errors
// (Armstrong and Kolesar 2018).
double half_width_under_bias(double bias);

// The interval of an estimate with that standard error and a bias of at most that.
struct Interval {
  double low = 0.0, high = 0.0;
};
Interval interval_95(double value, double std, double bias = 0.0);

// Widens the intervals of a fit by least squares by its biases, of the filters (which a fit at twice the cut-off shows)
// and of noise in its columns (regressor_noise.hpp), and its standard errors by what they did not count of that noise.
// `model` is what the search for nonlinear parameters began from.
void count_biases(Identification& identification, const data::Dataset& dataset, const model::Model& model,
                  const PipelineOptions& pipeline);

}  // namespace flexspline::estimation
