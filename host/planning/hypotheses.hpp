// The effects between which a plan is to decide, with sizes to decide about.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/planning/bench.hpp"
#include "host/planning/information.hpp"

namespace flexspline::planning {

// The model with one effect more: as the data show it, or, where they do not, of the usual size; and the same over a
// grid of its shapes, among which an imitation may choose.
struct Contender {
  std::string label;  // "torque_ripple:2"
  Hypothesis truth;
  std::vector<Hypothesis> variants;
  bool seen = false;  // its size comes from the data
};

// The model without an effect, if it has it.
Terms without(const Terms& terms, std::string_view effect);

// `base` is the model with neither of the two; an effect that the bench's model has keeps the size that it has there.
// `noise` of the sides is lowered to what the model with the effect leaves. Throws model::ModelError where the effect
// cannot be added to the model.
Contender contender(Bench& bench, Layout& layout, const Terms& base, std::string_view effect);

}  // namespace flexspline::planning
