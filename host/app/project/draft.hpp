// A first dataset.toml from what a logger left: columns guessed, experiments listed, a single record split.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/app/project/column_guess.hpp"
#include "host/app/project/request.hpp"
#include "host/input/data/dataset_toml.hpp"

namespace flexspline::project {

struct Draft {
  data::DatasetToml toml;                       // files with absolute paths
  std::map<std::string, std::string> comments;  // by column of ours
  std::string axis_comment;
  std::string gear_comment;
  std::vector<std::string> notes;    // what was guessed, for people
  std::vector<ColumnGuess> columns;  // guessed or mapped
  std::vector<std::string> there;    // columns of ours that are there, by their name or mapped
  std::vector<std::string> unused;
  std::vector<int> joints;       // numbers of those in the file; empty: one
  std::optional<int> joint;      // that was taken
  std::string needs_pole_pairs;  // a speed in electrical turns
  bool from_toml = false;        // all of it is in a dataset.toml
  std::optional<Side> side;      // of the only position, where there is one
  std::string open_question;     // "what; what to do": without an answer the work cannot continue
};

// From CSV and MAT files and folders of them, or from one dataset.toml, whose facts are kept.
// Throws data::DataError and RequestError.
Draft draft_of(const Request& request);

// Reads the measurements as the draft describes them.
data::Dataset load_draft(const Draft& draft, const Request& request);

// Adds what only the values show: the gear ratio, and the split of a single record.
void take_facts_of_values(Draft& draft, data::Dataset& dataset);

// Why the only position may be of the other side of the gear: speeds that no motor, or no link of a robot, has.
std::vector<std::string> implausible_sides(const Draft& draft, const data::Dataset& dataset);

// The text of dataset.toml in `folder`; files are named relative to it.
std::string text_of(const Draft& draft, const std::filesystem::path& folder);

// A key's value that is text.
inline data::KeyValue text_value(const std::string& text) {
  return {text, std::nullopt, "", 0};
}

}  // namespace flexspline::project
