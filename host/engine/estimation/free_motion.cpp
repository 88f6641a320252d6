#include "host/engine/estimation/free_motion.hpp"

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/in_parallel.hpp"

namespace flexspline::estimation {
namespace {

using data::Column;

// The simulated signal in place of the measured one, within the segments; false where it is not finite.
bool replace(data::Experiment& experiment, Column column, const std::vector<double>& simulated) {
  if (!experiment.has(column)) return true;
  if (simulated.empty()) return false;
  std::vector<double>& values = experiment[column];
  for (const data::Segment& s : experiment.segments)
    for (std::size_t k = s.first; k < s.last; ++k) {
      if (!std::isfinite(simulated[k])) return false;
      values[k] = simulated[k];
    }
  return true;
}

bool simulate(const model::Model& model, const data::Experiment& measured, const simulation::Options& options,
              data::Experiment& result) {
  simulation::FreeRun run;
  try {
    run = simulation::run(model, measured, options);
  } catch (const simulation::ModelIncomplete&) {
    return false;
  } catch (const std::invalid_argument&) {
    return false;
  }
  data::Experiment changed = measured;
  const bool locked = measured.load == data::Load::locked;
  const bool finite = replace(changed, Column::motor_position, run.motor_position) &&
                      replace(changed, Column::motor_velocity, run.motor_velocity) &&
                      (locked || (replace(changed, Column::output_position, run.output_position) &&
                                  replace(changed, Column::output_velocity, run.output_velocity))) &&
                      replace(changed, Column::torque, run.torque);
  if (finite) result = std::move(changed);
  return finite;
}

}  // namespace

model::Model model_with_values(const Identification& identification) {
  model::Model model = identification.model;
  for (const Term& term : identification.terms) {
    model::Effect* effect = model.find(term.id);
    if (!effect) continue;
    const std::vector<double> values = catalogue::natural(*term.entry, term.values);
    for (std::size_t p = 0; p < values.size(); ++p) {
      model::Parameter* parameter = effect->find(term.entry->parameters[p].name);
      if (!parameter) continue;
      parameter->value = values[p];
      parameter->unit = std::string(catalogue::unit_on(term.entry->parameters[p].unit, model.drive.axis));
    }
  }
  return model;
}

FreeMotion free_motion(const Identification& identification, const FreeMotionOptions& options) {
  const model::Model model = model_with_values(identification);
  const PreparedData& measured = identification.prepared;
  const std::size_t records = measured.records.size();
  FreeMotion result;
  result.experiments.resize(records);
  result.prepared.pipeline = measured.pipeline;
  result.prepared.constants = measured.constants;
  result.prepared.output_signals = measured.output_signals;
  result.prepared.effort_is_current = measured.effort_is_current;
  result.prepared.rotary = measured.rotary;
  result.prepared.records.resize(records);
  result.simulated.assign(records, 0);
  in_parallel(records, [&](std::size_t i) {
    if (!options.only.empty() && !options.only[i]) return;
    simulation::Options how;
    how.step_s = options.step_s;
    if (!options.initial_velocity.empty()) how.initial_motor_velocity = options.initial_velocity[i];
    data::Experiment& experiment = result.experiments[i];
    experiment = *measured.records[i].experiment;
    if (simulate(model, *measured.records[i].experiment, how, experiment)) result.simulated[i] = 1;
    Record& record = result.prepared.records[i];
    record = std::move(prepare_with({&experiment}, identification.model.drive, measured.pipeline).records.front());
    record.rows = measured.records[i].rows;
    record.at_rest = measured.records[i].at_rest;
  });
  return result;
}

}  // namespace flexspline::estimation
