// Short intervals in which something acted on the axis that is no property of the drive: a push, a force step, a cable
// that caught. They are found in the residual alone.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"
#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

// A burst: samples whose residual stands far above the rest, though the axis passes through the same velocity and the
// same time after a reversal at other places without such a residual. An effect of the drive shows wherever its signals
// come back; a disturbance does not. Returns the intervals in time; `keep` gets zeros at their samples and at their
// filter's reach around them.
std::vector<Disturbance> find_disturbances(const estimation::RegressionProblem& data, const Eigen::VectorXd& residual,
                                           Eigen::VectorXd& keep);

}  // namespace flexspline::selection
