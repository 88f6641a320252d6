// Models side by side in closed loop on one drive, with the same loops each time: what is predicted, and what comes.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "host/app/closed_loop/page.hpp"

namespace flexspline::closed_loop {

struct ComparedModel {
  std::string label;  // "base", "added", ...
  std::string name;   // where the model comes from, for a reader
  model::Model model;
  std::vector<std::uint8_t> block{};  // made by compare()
};

struct ComparisonSetup {
  Job job;  // drive, motion, seed; what is to be kept. Its block and compensation are set for each run
  // Settings of the drive (text of a "flexspline-drive/1" file), and where they are from.
  std::string settings;
  std::string settings_origin;
  // The first one's model sets the loops; the others get the same, whatever inertia they hold. The last one is the best
  // that is known of the drive: what is predicted is predicted from it.
  std::vector<ComparedModel> models;
  int draws = 0;  // of the prediction; zero: none
};

// Runs without compensation, then with each model's. `progress` is called at each stage, and may throw to cancel.
// Throws deployment::PackError where a model does not fit the drive, and what `run` throws; where there can be no
// prediction, the reason is in the comparison.
Comparison compare(ComparisonSetup setup, const Runner& run, const std::function<void(std::string_view)>& progress);

// The same runner, for groups of at most `size` jobs, one after the other. `done` is called with the number of finished
// jobs before each group, and may throw to cancel.
Runner in_groups(Runner run, std::size_t size, std::function<void(std::size_t)> done);

}  // namespace flexspline::closed_loop
