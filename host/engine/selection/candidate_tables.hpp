// Regressor tables of one data set, and the settings at which it is searched.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "host/engine/selection/bandwidth.hpp"
#include "host/engine/selection/regressor_table.hpp"

namespace flexspline::selection {

struct CandidateTables {
  Bandwidth bandwidth;
  RegressorTable table;                // without model columns: nothing can be chosen
  bool presliding_is_resolved = true;  // as PreslidingTravels has it
  bool torque_has_noise = false;       // of the sensor, white, in a record: terms read the modelled torque there
  std::vector<std::pair<double, bool>> settings;  // bandwidth in Hz, reversals left out

  // Whether a term can be seen at a bandwidth: waves below it, and above the motion's bandwidth waves alone.
  bool may_enter(const CandidateTerm& term, double cutoff_hz) const;
  // Whether a subsample of a setting may count for presliding, or against it: as of any law of friction, only at a
  // bandwidth of the motion; and there is none without reversals.
  bool shows_presliding(const std::pair<double, bool>& setting) const;
};

// The simplest effect that puts a state of presliding in the place of the sign of an effect of the model; null where
// none can.
const catalogue::Entry* presliding_law(const estimation::Terms& terms);

// Of all experiments, those that are held out among them.
CandidateTables make_tables(const std::vector<const data::Experiment*>& experiments, const model::Drive& drive,
                            const estimation::Terms& terms, Balance balance, const SelectionPolicy& policy);

}  // namespace flexspline::selection
