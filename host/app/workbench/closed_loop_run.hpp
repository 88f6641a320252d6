// The closed loop of the page: a motion on a simulated drive, without compensation, with the first step's model and
// with the present one's.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/app/closed_loop/compare.hpp"
#include "host/app/workbench/block_comparison.hpp"
#include "host/app/workbench/session.hpp"

namespace flexspline::workbench {

// A drive to be simulated: its true parameters, and the settings of its manufacturer.
struct SimulatedPlant {
  std::string plant;       // text of a plant file
  std::string plant_file;  // in its place; both empty: none is known
  std::string settings;    // text of a "flexspline-drive/1" file
  std::string settings_origin;
  std::string what;  // for the page: what is simulated
  bool is_known() const { return !plant.empty() || !plant_file.empty(); }
};

// A drive whose true model is `truth`, with the encoders of the data where they state them. Throws std::runtime_error
// where a twin cannot simulate it.
SimulatedPlant plant_of(const model::Model& truth, const data::Dataset& dataset, std::string what);
// The simulated drive of these recordings: its true values are in truth.toml in the same folder. The result is empty
// where there is no such file, or it is not enough for a twin.
SimulatedPlant plant_of_recordings(const std::vector<std::filesystem::path>& data, const data::Dataset& dataset);

// Motions that the page offers, simplest first.
const std::vector<std::string>& closed_loop_scenarios();

// `plant_setup`: where it is unknown, a drive whose true model is the present one. The runs keep their traces. Throws
// std::runtime_error with the reason where that is impossible.
closed_loop::Comparison run_closed_loop(const Step& first, const Step& now, SimulatedPlant& plant_setup,
                                        const std::string& scenario, const closed_loop::Runner& run,
                                        const Progress& progress);

// The result: "flexspline-hil/1" with "plant" (what was simulated) and "is_model" (it was the present model).
nlohmann::json closed_loop_json(const closed_loop::Comparison& comparison, const SimulatedPlant& plant_setup,
                                bool is_model);

// What `flexspline flash` predicts of the gain of a model on a drive, with "in_words"; {"problem"} where it cannot.
nlohmann::json predicted_gain(const model::Model& model, const ComparedBlocks& blocks, const closed_loop::Runner& run,
                              const Progress& progress);

}  // namespace flexspline::workbench
