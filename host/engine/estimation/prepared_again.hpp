// Other experiments in the place of those of a fit, prepared in the same way: with noise added, or another recording of
// the same motion.
#pragma once

#include <vector>

#include "host/engine/estimation/record.hpp"
#include "host/engine/estimation/terms.hpp"

namespace flexspline::estimation {

// By `pipeline` and the constants of `original`, with the torque that the terms make of the weight where it is not
// measured. Its records have rows of their own, and torsions without the zero of a record.
PreparedData prepare_as(const PreparedData& original, const Pipeline& pipeline,
                        const std::vector<const data::Experiment*>& experiments, const Terms& terms);

// The zero of the torsion that was found for another record of this joint.
void take_torsion_zero(Record& record, const Record& original);

// What was decided about the record of which `record` is a copy with other noise: its samples, its rest and its zero.
void take_decisions(Record& record, const Record& original);

}  // namespace flexspline::estimation
