// Constants of each record: a torsion with another zero in every recording. The model holds one value
// for all (`torsion_zero`); how far single records are from it is found here, and moved out of their signals.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::estimation {

// The parameters of the model that are constants of each record and that the user has not fixed.
std::vector<ParameterRef> record_constants(const Terms& terms);

// One step of Gauss and Newton on `data` at the values of `terms`: the constants of all records together with the
// parameters in `together_with` (linear and nonlinear ones), which would else take up a part of them. Moves the torsion
// of each record by its constant less their mean, and adds that to Record::torsion_zero_rad. Afterwards balances have
// to be formed again. False, and nothing changes, where there are fewer than two records, or nothing to move.
bool refine_record_constants(PreparedData& prepared, const RegressionProblem& data, const Terms& terms,
                             const std::vector<ParameterRef>& together_with, const Eigen::VectorXd& root_weights);

}  // namespace flexspline::estimation
