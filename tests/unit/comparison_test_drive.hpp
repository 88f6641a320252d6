// Records of the twin as a data set in memory, and the model that the twin really is.
#pragma once

#include <string>
#include <vector>

#include "hil/plant/physics.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::comparison {

using tests::experiment_of;

// The same as sensors without noise and with any resolution would have seen it.
inline data::Experiment noiseless_experiment_of(plant::Record r, const plant::Drive& drive) {
  r.current_a = r.truth.current_a;
  for (double& current : r.current_a) current += plant::sensor_errors_of(drive).current_offset_a;
  r.motor_position_rad = r.truth.motor_position_rad;
  r.output_position_rad = r.truth.output_position_rad;
  r.torque_nm = r.truth.torque_nm;
  r.temperature_c = r.truth.temperature_c;
  return experiment_of(r, drive);
}

inline plant::ExperimentPlan plan(std::string name, plant::Mode mode, plant::Waveform waveform, double amplitude,
                                  double frequency_hz, double duration_s, bool locked = false) {
  plant::ExperimentPlan p;
  p.name = std::move(name);
  p.mode = mode;
  p.waveform = waveform;
  p.amplitude = amplitude;
  p.frequency_hz = frequency_hz;
  p.duration_s = duration_s;
  p.locked = locked;
  return p;
}

inline data::Dataset record(const plant::Drive& drive, const std::vector<plant::ExperimentPlan>& plans,
                            std::uint64_t seed) {
  data::Dataset dataset;
  for (const plant::Record& r : plant::record_all(drive, plans, seed))
    dataset.experiments.push_back(experiment_of(r, drive));
  return dataset;
}

// All effects that are present and not hidden, with their true values.
inline model::Model known_model(const plant::Drive& drive) {
  return tests::model_of(drive, false, true);
}

inline std::vector<const data::Experiment*> pointers(const data::Dataset& dataset) {
  std::vector<const data::Experiment*> all;
  for (const data::Experiment& e : dataset.experiments) all.push_back(&e);
  return all;
}

}  // namespace flexspline::comparison
