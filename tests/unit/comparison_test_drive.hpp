// Records of the twin as a data set in memory, and the model that the twin really is.
#pragma once

#include <string>
#include <vector>

#include "hil/plant/physics.hpp"
#include "hil/plant/recorder.hpp"
#include "host/catalogue/constants.hpp"
#include "host/data/dataset.hpp"
#include "host/model/model.hpp"

namespace flexspline::comparison {

inline data::Experiment experiment_of(const plant::Record& r, const plant::Drive& drive) {
  using data::Column;
  data::Experiment e;
  e.name = r.name;
  e.role = r.holdout ? data::Role::holdout : data::Role::fit;
  e.load = r.locked ? data::Load::locked : data::Load::free;
  e.sample_s = drive.sample_s;
  e.time_s = r.time_s;
  e.segments = {{0, r.time_s.size()}};
  e[Column::current] = r.current_a;
  e[Column::motor_position] = r.motor_position_rad;
  e[Column::output_position] = r.output_position_rad;
  e[Column::torque] = r.torque_nm;
  e[Column::temperature] = r.temperature_c;
  e.noise_std[static_cast<std::size_t>(Column::current)] = r.current_noise_std;
  e.noise_std[static_cast<std::size_t>(Column::torque)] = r.torque_noise_std;
  e.encoder_counts = drive.sensors.motor_counts;
  e.output_encoder_counts = drive.sensors.output_counts;
  e.motor_position_zero = e.output_position_zero = data::PositionZero::absolute;
  return e;
}

// The same as sensors without noise and with any resolution would have seen it.
inline data::Experiment noiseless_experiment_of(plant::Record r, const plant::Drive& drive) {
  r.current_a = r.truth.current_a;
  for (double& current : r.current_a) current += plant::current_offset_of(drive);
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
  model::Model m;
  m.name = drive.name;
  m.drive.gear_ratio.value = drive.gear_ratio;
  m.drive.torque_constant_nm_a.value = drive.torque_constant_nm_a;
  m.drive.rated_velocity_rad_s.value = drive.rated_velocity_rad_s;
  m.drive.rated_torque_nm.value = drive.rated_torque_nm;
  m.drive.temperature_reference_c.value = drive.temperature_reference_c;
  for (const plant::Effect& effect : drive.effects) {
    if (!effect.present || effect.hidden) continue;
    model::Effect known = catalogue::blank_effect(catalogue::get(effect.type), data::Axis::rotary);
    for (const plant::Parameter& p : effect.parameters) known.find(p.key)->value = p.value;
    m.effects.push_back(known);
  }
  return m;
}

inline std::vector<const data::Experiment*> pointers(const data::Dataset& dataset) {
  std::vector<const data::Experiment*> all;
  for (const data::Experiment& e : dataset.experiments) all.push_back(&e);
  return all;
}

}  // namespace flexspline::comparison
