// Visits all effects that have a number, without a list of them. Include it after all effects: see list.hpp.
#pragma once

#include <type_traits>
#include <utility>

#include "shared/effects/effect.hpp"

namespace flexspline::effects {

// Calls visit.template operator()<Effect>(id) for each effect, by rising number.
template <class Visit, std::size_t... Ids>
constexpr void for_each_effect(Visit&& visit, std::index_sequence<Ids...>) {
  const auto one = [&]<std::size_t Id>(std::integral_constant<std::size_t, Id>) {
    using Effect = typename AtId<Id>::Effect;
    if constexpr (!std::is_void_v<Effect>) visit.template operator()<Effect>(Id);
  };
  (one(std::integral_constant<std::size_t, Ids>{}), ...);
}
template <class Visit>
constexpr void for_each_effect(Visit&& visit) {
  for_each_effect(visit, std::make_index_sequence<kLastId + 1>{});
}

}  // namespace flexspline::effects
