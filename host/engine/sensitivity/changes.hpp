// What may be done to a model to see what it depends on: an effect left out, a parameter scaled.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/physics/model/model.hpp"

namespace flexspline::sensitivity {

struct Change {
  std::string effect;     // id in the model
  std::string parameter;  // scaled; empty: the effect is left out
  double factor = 0.0;    // of the parameter

  bool leaves_out() const { return parameter.empty(); }
  // "without coulomb_friction", "linear_stiffness.stiffness x 10"
  std::string label() const;
};

// "EFFECT.PARAMETER=FACTOR". Throws std::invalid_argument saying what is wrong with the text.
Change parse_scaling(std::string_view text);

// Each effect left out, in the order of the model; then a linear stiffness at a tenth (report, section 5.4) and at ten
// times its value.
std::vector<Change> usual_changes(const model::Model& model);

// Throws model::ModelError unless the model has what is to be changed; it names what the model has instead.
void require_known(const model::Model& model, const Change& change);

struct ChangedModel {
  model::Model model;
  std::vector<std::string> also_left_out;  // effects that scaled what was left out, and nothing else
};

// The changed model; the other parameters stay. A scaled parameter is fixed at its new value. Throws model::ModelError
// as `require_known` does, and where the new value is outside the bounds of the catalogue, or there is none to scale.
ChangedModel apply(const model::Model& model, const Change& change);

}  // namespace flexspline::sensitivity
