#include "host/estimation/free_motion.hpp"

#include <algorithm>
#include <cmath>

#include "host/estimation/in_parallel.hpp"
#include "host/simulation/simulation.hpp"

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

bool simulate(const model::Model& model, const data::Experiment& measured, std::optional<double> initial_velocity,
              data::Experiment& result) {
  simulation::FreeRun run;
  simulation::Options options;
  options.initial_motor_velocity = initial_velocity;
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
  for (const regression::Term& term : identification.terms) {
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

FreeMotion free_motion(const Identification& identification, std::span<const std::optional<double>> initial_velocity) {
  const model::Model model = model_with_values(identification);
  const regression::Prepared& measured = identification.prepared;
  FreeMotion result;
  for (const regression::Record& record : measured.records) result.experiments.push_back(*record.experiment);
  result.simulated.assign(measured.records.size(), 0);
  in_parallel(measured.records.size(), [&](std::size_t i) {
    const std::optional<double> initial = initial_velocity.empty() ? std::nullopt : initial_velocity[i];
    if (simulate(model, *measured.records[i].experiment, initial, result.experiments[i])) result.simulated[i] = 1;
  });
  std::vector<const data::Experiment*> all;
  for (const data::Experiment& e : result.experiments) all.push_back(&e);
  result.prepared = regression::prepare_with(all, identification.model.drive, measured.pipeline);
  for (std::size_t i = 0; i < all.size(); ++i) {
    result.prepared.records[i].rows = measured.records[i].rows;
    result.prepared.records[i].at_rest = measured.records[i].at_rest;
  }
  return result;
}

}  // namespace flexspline::estimation
