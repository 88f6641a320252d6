// What many commands take: measurements, a model, how data are prepared, where answers go.
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/engine/estimation/record.hpp"
#include "host/input/data/dataset.hpp"
#include "host/output/answers/console.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::cli {

using output::Console;

// Arguments that do not fit together: "what; what to do". Exit 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr int kDone = 0;
inline constexpr int kNotMet = 1;  // a limit that the user gave
inline constexpr int kUnusable = 2;

struct DataInputs {
  std::vector<std::filesystem::path> data;
  std::vector<std::filesystem::path> holdout;
  std::vector<std::string> tolerate;
};

struct PipelineInputs {
  std::optional<double> cutoff_hz;
  std::string mask = "auto";
  std::string derivatives = "butterworth";

  estimation::PipelineOptions options() const {
    return {cutoff_hz, mask != "none", nullptr,
            derivatives == "kalman" ? estimation::Derivatives::kalman : estimation::Derivatives::butterworth};
  }
};

// Reads all measurements; those of `holdout` are never fitted, whatever role they state, and an experiment that both
// name is held out. Warnings are printed, notes are not. Throws data::DataError.
data::Dataset load(const DataInputs& inputs, Console& console);

// Throws model::ModelError.
model::ModelFile load_model(const std::filesystem::path& path);
// The same for commands that fit the model again and again; throws UsageError where it has so many parameters to be
// estimated that none of them would answer.
model::ModelFile load_searched_model(const std::filesystem::path& path);
// The same for commands that take the model as it is; throws UsageError where a parameter has no value.
model::Model load_identified_model(const std::filesystem::path& path);

// Paths as they would be typed after a command.
std::string as_arguments(const std::vector<std::filesystem::path>& paths);
std::string quoted(const std::string& argument);
// " --tolerate KIND" for each.
std::string tolerate_arguments(const std::vector<std::string>& kinds);
// Measurements with what is tolerated in them, those held out and how they are prepared, for a command that reads them
// again.
std::string as_arguments(const DataInputs& inputs, const PipelineInputs& pipeline);

// Throws UsageError with the nearest name where the catalogue has no such effect, nor is it one that users define.
void require_effect(const std::string& name);

void make_folder(const std::filesystem::path& folder);
// Throws UsageError where `folder` is not empty and the user did not ask for that by --force.
void require_empty_folder(const std::filesystem::path& folder, bool force);

}  // namespace flexspline::cli
