// Hundreds of drives: one command a drive, one that merges.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/cli/inputs.hpp"

namespace flexspline::cli {

struct FleetOptions {
  std::string action;  // run, merge
  std::vector<std::filesystem::path> places;
  std::filesystem::path model;  // empty: base-model.toml of each folder
  std::filesystem::path out;    // run: file for the result; empty: in the drive's folder
  bool diagnose = false;
  bool again = false;
  std::vector<std::string> tolerate;
  PipelineInputs pipeline;
  std::optional<double> limit;  // merge: of |z|
  std::string json;
};
int run(const FleetOptions& options, Console& console);

// Of the parser that CLI11 has; a template, so that its header stays in one file.
template <class Command>
void take_fleet(const Command& command) {
  auto* const sub = command.first;
  FleetOptions& options = *command.second;
  sub->add_option("ACTION", options.action, "run: one drive; merge: the results of all")
      ->required()
      ->type_name("{run,merge}");
  sub->add_option("FOLDER", options.places, "run: a drive's measurements; merge: results, or folders with them")
      ->required()
      ->type_name("");
  sub->add_option("--model", options.model, "run: model to identify (default: base-model.toml in the folder)")
      ->type_name("MODEL");
  sub->add_flag("--diagnose", options.diagnose, "run: diagnose, too");
  sub->add_flag("--again", options.again, "run: even where there is a result of the same files");
  sub->add_option("--out", options.out, "run: file for the result (default: fleet-result.json in the folder)")
      ->type_name("FILE");
  sub->add_option("--tolerate", options.tolerate, "run: treat a finding as a warning")
      ->type_name("KIND")
      ->delimiter(',')
      ->allow_extra_args(false);
  sub->add_option("--cutoff-hz", options.pipeline.cutoff_hz, "run: cut-off of both filters (default: from the data)")
      ->type_name("HZ");
  sub->add_option("--limit", options.limit,
                  "merge: robust z-score beyond which a drive differs (default: what one fleet in a hundred of equal "
                  "drives exceeds)")
      ->type_name("Z");
}

}  // namespace flexspline::cli
