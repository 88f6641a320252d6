// Balances from some of the experiments of a data set. For estimators that use records one group after the other.
#pragma once

#include <memory>
#include <vector>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

// Those of role fit. Throws data::DataError where there is none.
std::vector<const data::Experiment*> experiments_to_fit(const data::Dataset& dataset);

// As build_balances(), of these experiments alone.
std::unique_ptr<Identification> build_balances_from(const std::vector<const data::Experiment*>& fit_on,
                                                    const data::Dataset& dataset, const model::Model& model,
                                                    const PipelineOptions& options);

}  // namespace flexspline::estimation
