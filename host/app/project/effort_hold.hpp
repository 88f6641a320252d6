// Whether the effort of recordings is a command that the drive holds from sample to sample, or a value at the sample.
#pragma once

#include "host/app/project/draft.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::project {

// Logs seldom say it. An effort at the sample that is taken for a held one lags the motion by half a sample: where the
// model shows such a lag, beyond three standard errors, and the other assumption leaves less of it, draft and data set
// get current_hold = "none". What is stated stays.
void take_hold_of_values(const model::Model& model, Draft& draft, data::Dataset& dataset);

}  // namespace flexspline::project
