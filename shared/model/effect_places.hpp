// Where a drive model has its effects: which of them an image can run, how often, and the memory of each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <utility>

#include "shared/effects/list.hpp"

namespace flexspline::model {

// How often an effect can occur in one model: four times where a given parameter distinguishes them (the order of a
// ripple).
template <class Effect>
constexpr std::size_t places_of() {
  for (const effects::ParameterInfo& p : Effect::kParameters)
    if (p.kind == effects::Kind::given) return 4;
  return 1;
}

// The effects that a firmware image can run. All of them, as often as a model may have them; a tick checks for each
// whether it is present.
struct EveryEffect {
  static constexpr bool kFilled = false;
  static constexpr bool kTables = true;
  static constexpr std::size_t places(std::size_t, std::size_t most) { return most; }
};
// All except the user-defined ones: the points of a table take a kilobyte a place, which small processors do not have.
struct EveryFormula : EveryEffect {
  static constexpr bool kTables = false;
};
namespace detail {
constexpr std::string_view name_of(std::size_t number) {
  std::string_view name;
  effects::for_each_effect([&]<class Effect>(std::size_t id) {
    if (id == number) name = Effect::kInfo.name;
  });
  return name;
}
// Visits the names of a list, "coulomb_friction,torque_ripple".
template <class Visit>
constexpr void for_each_name(std::string_view list, Visit&& visit) {
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= list.size(); ++i) {
    if (i < list.size() && list[i] != ',') continue;
    if (i > begin) visit(list.substr(begin, i - begin));
    begin = i + 1;
  }
}
constexpr bool is_named(std::string_view list, std::string_view name) {
  bool found = false;
  for_each_name(list, [&](std::string_view one) { found = found || one == name; });
  return found;
}
// How many names of the list a drive cannot run: misspelt, or too large.
constexpr std::size_t unknown_names(std::string_view list) {
  std::size_t unknown = 0;
  for_each_name(list, [&](std::string_view one) {
    bool known = false;
    effects::for_each_effect([&]<class Effect>(std::size_t) {
      known = known || (Effect::kInfo.name == one && !Effect::kInfo.host_only && !Effect::kInfo.user_defined);
    });
    unknown += known ? 0 : 1;
  });
  return unknown;
}
}  // namespace detail

// The effects that `List::kNames` names, separated by commas; a tick checks for each whether it is present. A name that
// no effect of a drive has does not compile.
template <class List>
struct NamedEffects : EveryFormula {
  static_assert(detail::unknown_names(List::kNames) == 0,
                "FLEXSPLINE_EFFECTS: a name that no effect has, or none that runs on a drive");
  static constexpr std::size_t places(std::size_t number, std::size_t most) {
    return detail::is_named(List::kNames, detail::name_of(number)) ? most : 0;
  }
};

// What this image runs: all formulas, or those that its build names, which saves flash and memory.
#if defined(FLEXSPLINE_EFFECTS)
struct EffectsOfBuild {
  static constexpr std::string_view kNames = FLEXSPLINE_EFFECTS;
};
using ImageEffects = NamedEffects<EffectsOfBuild>;
#else
using ImageEffects = EveryFormula;
#endif

// The effects of these numbers, as often as each is listed. A tick runs all of them without a check: an effect that is
// not in the block has coefficients of zero and no influence.
template <std::size_t... Numbers>
struct TheseEffects {
  static constexpr bool kFilled = true;
  static constexpr bool kTables = true;
  static constexpr std::size_t places(std::size_t number, std::size_t most) {
    const std::size_t often = (std::size_t{0} + ... + (Numbers == number ? 1 : 0));
    return often < most ? often : most;
  }
};

template <class Effect, class N, std::size_t Count = places_of<Effect>()>
struct Places {
  std::uint8_t count = 0;
  std::array<typename Effect::template Coefficients<N>, Count> coefficients{};
  std::array<typename Effect::template State<N>, Count> states{};
};

namespace detail {
template <class Effect, class Image>
constexpr std::size_t places_in(std::size_t number) {
  if constexpr (std::is_void_v<Effect>) {
    return 0;
  } else if constexpr (Effect::kInfo.host_only || (Effect::kInfo.user_defined && !Image::kTables)) {
    return 0;
  } else {
    return Image::places(number, places_of<Effect>());
  }
}
template <std::size_t Id, class N, class Image,
          std::size_t Count = places_in<typename effects::AtId<Id>::Effect, Image>(Id)>
struct PlaceAt {
  static constexpr bool kExists = true;
  using Effect = typename effects::AtId<Id>::Effect;
  Places<Effect, N, Count> places{};
};
template <std::size_t Id, class N, class Image>
struct PlaceAt<Id, N, Image, 0> {
  static constexpr bool kExists = false;
};
template <class N, class Image, class Ids>
struct AllPlaces;
template <class N, class Image, std::size_t... Ids>
struct AllPlaces<N, Image, std::index_sequence<Ids...>> : PlaceAt<Ids, N, Image>... {
  template <class Visit>
  constexpr void for_each(Visit&& visit) {
    (visit_one<Ids>(*this, visit), ...);
  }
  template <class Visit>
  constexpr void for_each(Visit&& visit) const {
    (visit_one<Ids>(*this, visit), ...);
  }
  // The same for those whose bit is set in `present`, by groups: a tick does not check each effect.
  template <std::uint64_t kAmong, class Visit>
  constexpr void for_each_present(std::uint64_t present, Visit&& visit) {
    const auto low = static_cast<std::uint32_t>(present), high = static_cast<std::uint32_t>(present >> 32);
    visit_range<kAmong, 0>(low, visit);
    visit_range<kAmong, kRange>(low, visit);
    visit_range<kAmong, 2 * kRange>(high, visit);
    visit_range<kAmong, 3 * kRange>(high, visit);
  }
  // Signals that effects with memory read: their values at the previous tick are stored.
  static constexpr unsigned remembered() { return (0U | ... | remembered_by<Ids>()); }

 private:
  static constexpr std::size_t kGroup = 4, kRange = 16;
  static_assert(sizeof...(Ids) <= 4 * kRange);
  template <std::uint64_t kAmong, std::size_t First, class Visit>
  constexpr void visit_range(std::uint32_t word, Visit& visit) {
    constexpr std::uint32_t kBits = exists_from<kAmong, First, kRange>() << (First % 32);
    if constexpr (kBits != 0) {
      if ((word & kBits) == 0) return;
      [&]<std::size_t... Groups>(std::index_sequence<Groups...>) {
        (visit_group<kAmong, First + Groups * kGroup>(word, visit), ...);
      }
      (std::make_index_sequence<kRange / kGroup>{});
    }
  }
  template <std::uint64_t kAmong, std::size_t First, class Visit>
  constexpr void visit_group(std::uint32_t word, Visit& visit) {
    constexpr std::uint32_t kBits = exists_from<kAmong, First, kGroup>() << (First % 32);
    if constexpr (kBits != 0) {
      if ((word & kBits) == 0) return;
      [&]<std::size_t... I>(std::index_sequence<I...>) {
        (visit_present<kAmong, First + I>(word, visit), ...);
      }
      (std::make_index_sequence<kGroup>{});
    }
  }
  template <std::uint64_t kAmong, std::size_t Id, class Visit>
  constexpr void visit_present(std::uint32_t word, Visit& visit) {
    if constexpr (exists<kAmong, Id>()) {
      if ((word & (std::uint32_t{1} << (Id % 32))) != 0) visit_one<Id>(*this, visit);
    }
  }
  template <std::uint64_t kAmong, std::size_t Id>
  static constexpr bool exists() {
    if constexpr (Id < sizeof...(Ids)) return PlaceAt<Id, N, Image>::kExists && (kAmong >> Id & 1) != 0;
    return false;
  }
  template <std::uint64_t kAmong, std::size_t First, std::size_t Count>
  static constexpr std::uint32_t exists_from() {
    return []<std::size_t... I>(std::index_sequence<I...>) {
      return (0U | ... | (exists<kAmong, First + I>() ? 1U << I : 0U));
    }
    (std::make_index_sequence<Count>{});
  }
  template <std::size_t Id, class Self, class Visit>
  static constexpr void visit_one(Self& self, Visit& visit) {
    using Place = PlaceAt<Id, N, Image>;
    if constexpr (Place::kExists) {
      using Which = std::conditional_t<std::is_const_v<Self>, const Place, Place>;
      visit.template operator()<typename Place::Effect>(static_cast<Which&>(self).places);
    }
  }
  template <std::size_t Id>
  static constexpr unsigned remembered_by() {
    if constexpr (PlaceAt<Id, N, Image>::kExists) {
      using Effect = typename PlaceAt<Id, N, Image>::Effect;
      if constexpr (!std::is_empty_v<typename Effect::template State<N>>) return Effect::kInfo.reads;
    }
    return 0U;
  }
};
// At rest every state of every effect is zero. Written this way it is one call instead of many stores.
template <class States>
constexpr void set_to_rest(States& states) {
  if (std::is_constant_evaluated() || !std::is_trivially_copyable_v<States>) {
    states = {};
  } else {
    std::memset(static_cast<void*>(&states), 0, sizeof(states));
  }
}
struct Nothing {};
// T where `kKept`, otherwise nothing.
template <bool kKept, class T>
struct Slot {
  using Type = T;
};
template <class T>
struct Slot<false, T> {
  using Type = Nothing;
};
}  // namespace detail

}  // namespace flexspline::model
