#include "host/engine/estimation/prepared_again.hpp"

#include "host/engine/estimation/modelled_torque.hpp"

namespace flexspline::estimation {

PreparedData prepare_as(const PreparedData& original, const Pipeline& pipeline,
                        const std::vector<const data::Experiment*>& experiments, const Terms& terms) {
  PreparedData prepared = prepare_with(experiments, original.drive, pipeline);
  prepared.constants = original.constants;
  prepared.output_signals = original.output_signals;
  take_torque_where_read(prepared, terms);
  return prepared;
}

void take_torsion_zero(Record& record, const Record& original) {
  record.torsion_zero_rad = original.torsion_zero_rad;
  record.inputs.torsion_zero = original.inputs.torsion_zero;
}

void take_decisions(Record& record, const Record& original) {
  record.rows = original.rows;
  record.at_rest = record.inputs.at_rest = original.at_rest;
  take_torsion_zero(record, original);
}

}  // namespace flexspline::estimation
