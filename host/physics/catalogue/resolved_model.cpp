#include "host/physics/catalogue/resolved_model.hpp"

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::catalogue {

ResolvedModel::ResolvedModel(const model::Model& of) : model(&of), constants(constants_of(of.drive)) {
  for (const model::Effect& effect : of.effects) {
    const Entry& entry = entry_of(effect);
    effects.push_back({&effect, &entry, values_of(effect, entry)});
  }
}

}  // namespace flexspline::catalogue
