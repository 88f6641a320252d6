// How small the residual of a perfect model would be, from the best source that the data offer.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::comparison {

struct NoiseFloor {
  std::optional<double> rmse;  // N m (N on a linear axis), over the samples of the record
  std::string from = "none";   // periods, replicates, propagated, none
};

// Floor of the residual of each range of `data.records()`, for a model with the values in `terms`. Sources, best first:
// period-to-period variance where the motion repeats itself; replicates; stated noise and quantisation of the columns
// propagated through the pipeline. Never extrapolated from above the band. Replicates of a record are looked for among
// `experiments`: those that a key names as such, and those with the same position set points.
std::vector<NoiseFloor> noise_floors(const estimation::RegressionProblem& data, const estimation::Terms& terms,
                                     const std::vector<const data::Experiment*>& experiments,
                                     const model::Drive& drive);

// Of all records together, weighted by their samples; none where any record has none.
NoiseFloor pooled(const std::vector<NoiseFloor>& floors, const std::vector<estimation::RowRange>& records);

}  // namespace flexspline::comparison
