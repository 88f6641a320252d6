// A drive model as the drive runs it: a fixed place for each effect of the image, no heap, every tick the same work.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "shared/effects/list.hpp"

namespace flexspline::model {

// How often an effect can stand in one model: those told apart by a given parameter (orders of a ripple) four times.
template <class Effect>
constexpr std::size_t places_of() {
  for (const effects::ParameterInfo& p : Effect::kParameters)
    if (p.kind == effects::Kind::given) return 4;
  return 1;
}

template <class Effect, class N>
struct Places {
  std::uint8_t count = 0;
  std::array<typename Effect::template Coefficients<N>, places_of<Effect>()> coefficients{};
  std::array<typename Effect::template State<N>, places_of<Effect>()> states{};
};

namespace detail {
template <class Effect>
constexpr bool runs_on_drive() {
  if constexpr (std::is_void_v<Effect>) {
    return false;
  } else {
    return !Effect::kInfo.host_only;
  }
}
struct Nothing {};
template <std::size_t Id, class N, bool kRuns = runs_on_drive<typename effects::AtId<Id>::Effect>()>
struct PlaceAt {
  static constexpr bool kExists = false;
};
template <std::size_t Id, class N>
struct PlaceAt<Id, N, true> {
  static constexpr bool kExists = true;
  using Effect = typename effects::AtId<Id>::Effect;
  Places<Effect, N> places{};
};
template <class N, class Ids>
struct AllPlaces;
template <class N, std::size_t... Ids>
struct AllPlaces<N, std::index_sequence<Ids...>> : PlaceAt<Ids, N>... {
  template <class Visit>
  constexpr void for_each(Visit&& visit) {
    (visit_one<Ids>(visit), ...);
  }

 private:
  template <std::size_t Id, class Visit>
  constexpr void visit_one(Visit& visit) {
    using Place = PlaceAt<Id, N>;
    if constexpr (Place::kExists) visit.template operator()<typename Place::Effect>(static_cast<Place&>(*this).places);
  }
};
}  // namespace detail

// All effects of the catalogue that run on a drive, in the number system N.
template <class N>
class DriveModel {
 public:
  using Numbers = N;
  // The number of an effect in parameter blocks.
  template <class Effect>
  static constexpr std::size_t number_of() {
    return id_of<Effect>();
  }
  // No effects.
  constexpr void clear() {
    places_.for_each([]<class Effect>(Places<Effect, N>& places) { places.count = 0; });
    reset();
  }
  // Adds an effect at rest. Returns false where the model already has it as often as it can.
  template <class Effect>
  constexpr bool add(const typename Effect::template Coefficients<N>& coefficients) {
    auto& places = static_cast<detail::PlaceAt<id_of<Effect>(), N>&>(places_).places;
    if (places.count == places.coefficients.size()) return false;
    places.coefficients[places.count] = coefficients;
    places.states[places.count] = {};
    ++places.count;
    return true;
  }
  // Calls visit.operator()<Effect>(places) for each effect that the drive can run, by rising number.
  template <class Visit>
  constexpr void for_each(Visit&& visit) {
    places_.for_each(visit);
  }
  // The state of rest: as after add().
  constexpr void reset() {
    places_.for_each([]<class Effect>(Places<Effect, N>& places) { places.states = {}; });
    started_ = false;
  }

  // One tick. `in` has what is measured or set: positions, velocities, accelerations, directions, torque, current,
  // temperature, all within two bases, which the caller limits once, at entry. Returns the torques of the three
  // balances. The first tick only takes note of where the drive stands.
  constexpr effects::Torques<N> tick(effects::Inputs<N> in) { return tick(in, in.angle); }
  // The same with another angle for effects that repeat with it and have no memory (ripples): a model along a set point
  // may take what is periodic from where the motor stands.
  constexpr effects::Torques<N> tick(effects::Inputs<N> in, typename N::Angle periodic_angle) {
    const auto angle = in.angle;
    complete(in);
    shift(in, periodic_angle);
    modulate(in);
    if (!started_) before_ = in;
    started_ = true;
    effects::Torques<N> out{};
    places_.for_each([&]<class Effect>(Places<Effect, N>& places) {
      for (std::size_t i = 0; i < places.count; ++i) {
        auto& state = places.states[i];
        const auto& coefficients = places.coefficients[i];
        in.angle = is_periodic<Effect>() ? periodic_angle : angle;
        Effect::advance(state, coefficients, in, before_);
        if constexpr (Effect::kInfo.phase == effects::Phase::source || Effect::kInfo.adds_to != 0)
          Effect::evaluate(state, coefficients, in, out);
      }
    });
    before_ = in;
    before_.angle = angle;
    return out;
  }

 private:
  template <class Effect, std::size_t Id = 0>
  static constexpr std::size_t id_of() {
    if constexpr (std::is_same_v<typename effects::AtId<Id>::Effect, Effect>) {
      return Id;
    } else {
      return id_of<Effect, Id + 1>();
    }
  }
  template <class Effect>
  static constexpr bool is_periodic() {
    return (Effect::kInfo.reads & effects::kMotorAngle) != 0 && std::is_empty_v<typename Effect::template State<N>>;
  }
  static constexpr void complete(effects::Inputs<N>& in) {
    in.speed = N::magnitude(in.velocity);
    in.torque_magnitude = N::magnitude(in.torque);
    in.viscous_scale = N::one();
    in.coulomb_scale = N::one();
    in.elapsed = N::one();
  }
  // The dead zone of a backlash lies behind everything else that changes the torsion.
  constexpr void shift(effects::Inputs<N>& in, typename N::Angle periodic_angle) {
    const auto angle = in.angle;
    for (const bool last : {false, true}) {
      places_.for_each([&]<class Effect>(Places<Effect, N>& places) {
        if constexpr (Effect::kInfo.phase == effects::Phase::shift) {
          if (Effect::kInfo.acts_last != last) return;
          in.angle = is_periodic<Effect>() ? periodic_angle : angle;
          for (std::size_t i = 0; i < places.count; ++i) Effect::shift(places.coefficients[i], in);
        }
      });
    }
    in.angle = angle;
  }
  constexpr void modulate(effects::Inputs<N>& in) {
    places_.for_each([&]<class Effect>(Places<Effect, N>& places) {
      if constexpr (Effect::kInfo.phase == effects::Phase::modulate) {
        for (std::size_t i = 0; i < places.count; ++i) Effect::modulate(places.coefficients[i], in);
      }
    });
  }

  detail::AllPlaces<N, std::make_index_sequence<effects::kLastId + 1>> places_;
  effects::Inputs<N> before_{};
  bool started_ = false;
};

}  // namespace flexspline::model
