// The effects that a plan is to distinguish, with their sizes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/engine/planning/information.hpp"
#include "host/engine/planning/rehearsed_motions.hpp"

namespace flexspline::planning {

// The model with one effect more: as the data show it, or, where they do not, of the usual size; and the same over a
// grid of its nonlinear parameters, from which another effect may be fitted.
struct EffectHypothesis {
  std::string label;  // "torque_ripple:2"
  Hypothesis truth;
  std::vector<Hypothesis> variants;
  bool seen = false;  // its size comes from the data
};

// The model without an effect, if it has it.
Terms without(const Terms& terms, std::string_view effect);

// `base` is the model with neither of the two; an effect that the rehearsed model has keeps the size that it has there.
// `noise` of the balances is lowered to what the model with the effect leaves. Throws model::ModelError where the
// effect cannot be added to the model.
EffectHypothesis effect_hypothesis(RehearsedMotions& rehearsed, ColumnLayout& layout, const Terms& base,
                                   std::string_view effect);

}  // namespace flexspline::planning
