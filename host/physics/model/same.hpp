// Whether two models are the same when written.
#pragma once

#include "host/physics/model/known_effects.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::model {

// The effects of a model, without bounds: enough to read back what was written from it.
class EffectsOfModel : public KnownEffects {
 public:
  explicit EffectsOfModel(const Model& model);
  const KnownEffect* find(std::string_view name) const override;
  std::vector<std::string_view> names() const override;

 private:
  std::vector<std::string> type_names_;
  std::vector<std::vector<std::string>> parameter_names_;
  std::vector<KnownEffect> effects_;
};

// Without what cannot be written and need not be: standard deviations, spreads and errors that are not finite are not
// known. An effect without an id has its type as id. Throws std::logic_error for a value that is not finite, for ids
// that are there twice, and for an effect or parameter without a name.
Model without_unknowns(Model model);

// Throws std::logic_error naming the first difference where `text` does not read as `model`, to the digits that are
// written; the order of the effects does not count.
void require_reads_as(const std::string& text, const Model& model);

}  // namespace flexspline::model
