// Recordings of the plant as a data set in memory, and its truth as a model: what tests that judge the host on the twin
// start from. Host and hil know nothing of each other; here they meet.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "hil/plant/recorder.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::tests {

inline data::Experiment experiment_of(const plant::Record& record, const plant::Drive& drive) {
  using data::Column;
  data::Experiment e;
  e.name = record.name;
  e.role = record.holdout ? data::Role::holdout : data::Role::fit;
  e.load = record.locked ? data::Load::locked : data::Load::free;
  e.current_hold = data::CurrentHold::zoh;
  e.sample_s = drive.sample_s;
  e.time_s = record.time_s;
  e[Column::current] = record.current_a;
  e[Column::motor_position] = record.motor_position_rad;
  e[Column::output_position] = record.output_position_rad;
  e[Column::torque] = record.torque_nm;
  e[Column::temperature] = record.temperature_c;
  e[Column::load_torque] = record.load_torque_nm;
  e.noise_std[static_cast<std::size_t>(Column::current)] = record.current_noise_std;
  e.noise_std[static_cast<std::size_t>(Column::torque)] = record.torque_noise_std;
  e.segments = {{0, e.time_s.size()}};
  e.masked.assign(e.time_s.size(), 0);
  e.encoder_counts = drive.sensors.motor_counts;
  e.output_encoder_counts = drive.sensors.output_counts;
  e.motor_position_zero = e.output_position_zero = data::PositionZero::absolute;
  return e;
}

inline data::Dataset dataset_of(const plant::Drive& drive, const std::vector<plant::Record>& records) {
  data::Dataset dataset;
  dataset.drive.axis = data::Axis::rotary;
  dataset.drive.gear_ratio = drive.gear_ratio;
  dataset.drive.torque_constant_nm_a = drive.torque_constant_nm_a;
  for (const plant::Record& record : records) dataset.experiments.push_back(experiment_of(record, drive));
  return dataset;
}

// All that is in the drive, or all but the hidden effect; with true values or with none.
inline model::Model model_of(const plant::Drive& drive, bool with_hidden, bool with_values) {
  model::Model model;
  model.name = drive.name;
  model.drive.gear_ratio.value = drive.gear_ratio;
  model.drive.torque_constant_nm_a.value = drive.torque_constant_nm_a;
  model.drive.rated_current_a.value = drive.rated_current_a;
  model.drive.rated_velocity_rad_s.value = drive.rated_velocity_rad_s;
  model.drive.rated_torque_nm.value = drive.rated_torque_nm;
  model.drive.temperature_reference_c.value = drive.temperature_reference_c;
  for (const plant::Effect& effect : drive.effects) {
    if (!effect.present || (effect.hidden && !with_hidden)) continue;
    const catalogue::Entry* entry = catalogue::find(effect.type);
    if (!entry) continue;
    model::Effect ours = catalogue::blank_effect(*entry, data::Axis::rotary);
    if (effect.has("order")) ours.id = effect.type + "_" + std::to_string(std::lround(effect.value("order")));
    for (std::size_t p = 0; p < ours.parameters.size(); ++p)
      if (effect.has(ours.parameters[p].name) && (with_values || entry->parameters[p].kind == effects::Kind::given))
        ours.parameters[p].value = effect.value(ours.parameters[p].name);
    model.effects.push_back(std::move(ours));
  }
  // The drive lacks the effects that another one replaces.
  std::string replaced;
  for (const model::Effect& e : model.effects) replaced += std::string(catalogue::get(e.type).info->replaces) + ",";
  std::erase_if(model.effects, [&](const model::Effect& e) { return catalogue::names_contain(replaced, e.type); });
  // A drive whose dry friction is Dahl's is first taken for one with Coulomb friction.
  const plant::Effect* dahl = drive.find("dahl_friction");
  if (dahl && dahl->hidden && !with_hidden && !model.find("coulomb_friction"))
    model.effects.push_back(catalogue::blank_effect(catalogue::get("coulomb_friction"), data::Axis::rotary));
  return model;
}

}  // namespace flexspline::tests
