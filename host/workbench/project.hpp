// From recordings to a first step: what `flexspline new` does, with pictures. The functions are those of the command,
// and are given by it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/data/dataset.hpp"

namespace flexspline::workbench {

// What the user decided; all else is guessed.
struct Choices {
  std::vector<std::string> map;      // OURS=THEIRS[:UNIT]
  std::vector<std::string> without;  // columns of theirs that are not used
  std::vector<std::string> turned;   // columns of ours whose sign is the other one
  std::string axis, position_side;
  std::optional<int> joint, pole_pairs;
  std::optional<double> gear_ratio, torque_constant_nm_a, encoder_counts;
  std::vector<std::string> tolerate;
};

// From "choices" of a request. Throws AskedError where a value is none of its kind.
Choices choices_of(const nlohmann::json& asked);

struct Project {
  std::shared_ptr<const data::Dataset> dataset;
  std::string model_text;    // of a first model, without values
  std::string dataset_text;  // of a dataset.toml to be kept beside the recordings
};

struct Projects {
  // "flexspline-proposal/1": which column is taken for which, with a preview of the signals, and what is open
  // (README.md). Throws what reading throws where the files are no recordings.
  std::function<nlohmann::json(const std::vector<std::filesystem::path>& files, const Choices& choices)> propose;
  // Writes dataset.toml into `folder`. Throws what `flexspline new` says where it cannot finish.
  std::function<Project(const std::vector<std::filesystem::path>& files, const Choices& choices,
                        const std::filesystem::path& folder)>
      make;
};

}  // namespace flexspline::workbench
