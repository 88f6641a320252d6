// Adds an effect to a model, or removes one, and refits. Reports the error before and after, on fitted and on held-out
// data.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/user_defined_effects.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::selection {

struct Errors {
  double rmse_fit = 0.0;
  std::optional<double> rmse_holdout;  // none without hold-out records
};

struct Addition {
  std::string effect;  // "torque_ripple:2"
  std::string signal;  // "motor_balance", ...
  std::string unit;
  Errors before, after;
  std::optional<double> noise_floor;  // on the hold-out records where there are any, else on the fitted ones
  std::string noise_floor_from = "none";
  model::Model model;  // refitted, with the step in its history
  std::vector<estimation::Estimate> estimates;
  std::vector<std::pair<std::string, estimation::LearnedTable>> tables;  // of the refitted model, by id
  std::vector<std::string> warnings;
};

// What a user writes: a name of the catalogue, with an order where the effect has one ("torque_ripple:2"). Throws
// model::ModelError naming what is known instead.
struct EffectName {
  const catalogue::Entry* entry = nullptr;
  std::optional<double> order;
};
EffectName parse_effect(std::string_view text);

// The model with that effect, and without those that it replaces, not fitted yet. Throws model::ModelError where it
// cannot be added.
model::Model with_effect(const model::Model& model, const EffectName& name);

// Adds an effect and refits everything, nonlinear parameters continuously. Experiments of role fit are fitted, those of
// role holdout compared. Throws model::ModelError where the effect cannot be added and data::DataError where the data
// cannot show it. A user-defined effect (see user_defined_effects.hpp) is described by `given`.
Addition add(const data::Dataset& dataset, const model::Model& model, std::string_view effect,
             const estimation::PipelineOptions& options, const UserDefinition& given = {});

// Takes an effect out, by its id or its name, and refits.
Addition remove(const data::Dataset& dataset, const model::Model& model, std::string_view id,
                const estimation::PipelineOptions& options);

std::string_view balance_signal(estimation::Balance balance);

}  // namespace flexspline::selection
