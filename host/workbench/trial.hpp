// The closed loop of the page: a motion on a simulated drive, without compensation, with the first step's model and
// with the present one's.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/closed_loop/compare.hpp"
#include "host/workbench/session.hpp"

namespace flexspline::workbench {

// A drive to be simulated: what it is in truth, and what its maker set it to.
struct Rig {
  std::string plant;       // text of a plant file
  std::string plant_file;  // in its place; both empty: none is known
  std::string settings;    // text of a "flexspline-drive/1" file
  std::string settings_origin;
  std::string what;  // for the page: what is simulated
  bool is_known() const { return !plant.empty() || !plant_file.empty(); }
};

// A drive of which a model is true, with the encoders of the data where they say them. Throws std::runtime_error where
// a twin cannot be that.
Rig rig_of(const model::Model& truth, const data::Dataset& dataset, std::string what);
// The simulated drive that made these recordings: its true values stand in truth.toml beside them. None is known where
// there is no such file, or a twin cannot be made of it alone.
Rig rig_beside(const std::vector<std::filesystem::path>& data, const data::Dataset& dataset);

// Motions that the page offers, simplest first.
const std::vector<std::string>& trial_scenarios();

// `rig`: where none is known, a drive of which the present model is true. Its runs keep their traces. Throws
// std::runtime_error with the reason where it cannot be.
closed_loop::Comparison try_out(const Step& first, const Step& now, Rig& rig, const std::string& scenario,
                                const closed_loop::Runner& run, const Progress& say);

// What came of it: "flexspline-hil/1" with "plant" (what was simulated) and "is_model" (it was the present model).
nlohmann::json trial_json(const closed_loop::Comparison& comparison, const Rig& rig, bool is_model);

}  // namespace flexspline::workbench
