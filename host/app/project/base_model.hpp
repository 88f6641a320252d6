// Which model can be started from, given what was measured.
#pragma once

#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::project {

struct BaseModel {
  model::Model model;
  // A line a balance: what it gets and from which columns, or which column it lacks.
  std::vector<std::string> reasons;
};

// The effects that every drive has, on each torque balance whose signals are there: a
// simple base, so that what is missing shows. Known facts come from the data set; ratings are guessed from the largest
// values and their source says so.
BaseModel base_model(const data::Dataset& dataset, const std::string& name);

}  // namespace flexspline::project
