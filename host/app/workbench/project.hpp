// From recordings to a first step, as `flexspline new`. The command passes its functions.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::workbench {

// Choices of the user; everything else is guessed.
struct Choices {
  std::vector<std::string> map;      // OURS=THEIRS[:UNIT]
  std::vector<std::string> without;  // columns of theirs that are not used
  std::vector<std::string> turned;   // columns of ours whose sign is the other one
  std::string axis, position_side;
  std::optional<int> joint, pole_pairs;
  std::optional<double> gear_ratio, torque_constant_nm_a, encoder_counts, pitch_m;
  std::vector<std::string> tolerate;
};

// From "choices" of a request. Throws UnknownNameError where a value has the wrong type.
Choices choices_of(const nlohmann::json& body);

struct Project {
  std::shared_ptr<const data::Dataset> dataset;
  std::string model_text;    // of a first model, without values
  std::string dataset_text;  // of a dataset.toml to be kept in the folder of the recordings
};

struct Projects {
  // "flexspline-proposal/1": which column is taken for which, with a preview of the signals, and what is open
  // (README.md). Throws the errors of reading where the files are not recordings.
  std::function<nlohmann::json(const std::vector<std::filesystem::path>& files, const Choices& choices)> propose;
  // Writes dataset.toml into `folder`. Throws the message of `flexspline new` where it cannot finish.
  std::function<Project(const std::vector<std::filesystem::path>& files, const Choices& choices,
                        const std::filesystem::path& folder)>
      make;
};

}  // namespace flexspline::workbench
