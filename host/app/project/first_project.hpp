// A data set and a first model from recordings: what `new` writes into a folder, and what the workbench begins with.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/app/project/base_model.hpp"
#include "host/app/project/draft.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::project {

struct FirstProject {
  BaseModel base;
  data::Dataset dataset;
  std::vector<std::string> warnings;
};

// Completes the draft by what only the values show. Throws RequestError where a question is open or no torque balance
// can be formed, data::DataError where the measurements cannot be used.
FirstProject first_project(Draft& draft, const Request& request);

// The text of the model's file.
std::string text_of(const BaseModel& base);

}  // namespace flexspline::project
