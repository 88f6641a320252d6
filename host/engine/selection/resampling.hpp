// Stability selection and validation of its terms on the motor's balance, as part of a diagnosis.
#pragma once

#include <vector>

#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

// Experiments of role fit select the terms, those of role holdout validate them.
Resampling resample(const std::vector<const data::Experiment*>& experiments, const model::Drive& drive,
                    const estimation::Terms& terms);

}  // namespace flexspline::selection
