// The report's partition (3.4), and the search from several starts.
#pragma once

#include <cstdint>
#include <memory>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

// First the linear parameters of all effects without a free nonlinear parameter, alone; then, with those known, the
// others. As the report does it: simple and steady, but what the first part lacks goes into its parameters (compare
// with nls). Where a nonlinear parameter is a velocity, and the speeds of the records have a gap of a factor of three
// or more, the first part uses the fast records and the second one the slow ones (report 3.4, eq. 58 and 59).
std::unique_ptr<Identification> partitioned(const data::Dataset& dataset, const model::Model& model,
                                            const PipelineOptions& pipeline);

// Searches for the nonlinear parameters that the model does not state again from random places of their ranges, and
// keeps the best. Replaces the fits where one is better. Adds a warning where starts end at different places with like
// errors.
void search_from_several_starts(Identification& identification, int starts, std::uint64_t seed);

}  // namespace flexspline::estimation
