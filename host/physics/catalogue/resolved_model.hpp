// A model with what the catalogue knows of its effects, looked up once where the model begins to be used.
#pragma once

#include <vector>

#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::catalogue {

struct ResolvedEffect {
  const model::Effect* effect;
  const Entry* entry;
  std::vector<double> values;  // what `entry->make` takes, SI; zero where the model has no value
};

// Refers to the model, which has to outlive it. A function that takes one can be given a model.
struct ResolvedModel {
  // Throws as `entry_of` does.
  ResolvedModel(const model::Model& model);  // NOLINT(google-explicit-constructor)

  const model::Model* model;
  DriveConstants<double> constants;  // constants_of the model's drive
  std::vector<ResolvedEffect> effects;
};

}  // namespace flexspline::catalogue
