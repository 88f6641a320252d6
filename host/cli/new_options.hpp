// What the files of a first project are made from: new, and the start page of the workbench.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/cli/inputs.hpp"

namespace flexspline::cli {

struct NewOptions {
  DataInputs data;
  std::filesystem::path out;
  std::vector<std::string> map;      // OURS=THEIRS[:UNIT]
  std::vector<std::string> without;  // columns of theirs that are not used, whatever their names say
  std::vector<std::string> turned;   // columns of ours whose sign is the other one
  std::string axis;                  // empty: guessed
  std::string position_side;         // "link", "motor"; empty: guessed
  std::optional<int> pole_pairs;
  std::optional<int> joint;  // of a file with several
  std::optional<double> gear_ratio;
  std::optional<double> torque_constant_nm_a;
  std::optional<double> encoder_counts;
  bool force = false;
  std::string json;
};

}  // namespace flexspline::cli
