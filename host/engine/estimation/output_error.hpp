// Output error: the parameters with which the model's free run comes nearest to the measured motion and torque.
#pragma once

#include <functional>
#include <string_view>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

// Refits all parameters together from the values that least squares found. What is minimised, for each record: velocity
// of the motor where the load is free, its position where it is locked (there the effort dictates the torque), and the
// torque where it is measured, each over its error at the start. Parameters that the free run does not show keep their
// values, with a warning. A velocity that shapes friction may lie below the speeds that the mask of least squares
// leaves; where least squares stopped at the end of a range, the search starts from several values. A nonlinear
// parameter that the free run does not determine is marked as not identifiable, without an interval. Replaces residuals
// and covariances of the fits. `progress` gets what is being worked at.
void refit_to_output(
    Identification& identification, const std::function<void(std::string_view)>& progress = [](std::string_view) {});

}  // namespace flexspline::estimation
