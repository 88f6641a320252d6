// The runs of a scenario side by side: as JSON ("flexspline-hil/1"), as a page with plots, as a picture.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/app/closed_loop/prediction.hpp"
#include "host/app/closed_loop/runs.hpp"

namespace flexspline::closed_loop {

struct ComparedRun {
  std::string label;  // "none", "base", "added", "model"
  std::string model;  // where it comes from; empty: none
  Outcome outcome;
  std::optional<Prediction> predicted;
};

struct Comparison {
  std::string scenario;
  std::string processor;  // image; empty: the software board
  double velocity_loop_hz = 0.0;
  double integrator_per_s = 0.0;  // integral gain over proportional gain
  double position_loop_hz = 0.0;
  double seconds = 0.0;
  double tick_hz = 0.0;
  double realtime_factor = 0.0;   // of one run on one core
  std::string no_prediction;      // the reason
  std::vector<ComparedRun> runs;  // that without compensation first

  // From the settings of the drive.
  void take_gains(const control::DriveSetup<double>& setup);
  // Once the runs are there: times and speeds.
  void finish();
};

nlohmann::json to_json(const Comparison& comparison);
// The runs' traces, few enough points for a screen, in their order: packed "time", "command", "output", "error",
// "velocity", "current", "temperature" (host/output/report/README.md).
nlohmann::json traces_json(const Comparison& comparison);
// Whole or not at all; the runs need their traces.
void write_page(const std::filesystem::path& file, const Comparison& comparison);
// The error over time as an SVG, for a README. The runs need their traces.
std::string picture(const Comparison& comparison);

}  // namespace flexspline::closed_loop
