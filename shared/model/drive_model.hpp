// A drive model as the drive runs it: a fixed place for each effect of the image, no heap, the same work in every tick.
// The effects of an image are known at compile time: effects that it does not have cost nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>

#include "shared/effects/list.hpp"
#include "shared/fixed/types.hpp"
#include "shared/model/effect_places.hpp"

namespace flexspline::model {

// The effects of `Image` in the number system N.
template <class N, class Image = EveryEffect>
class DriveModel {
 public:
  using Numbers = N;
  static constexpr bool kTables = Image::kTables;
  // The number of an effect in parameter blocks.
  template <class Effect>
  static constexpr std::size_t number_of() {
    return id_of<Effect>();
  }
  // For reading effects from a parameter block (block.hpp): the places of the effect of this number.
  template <std::size_t Id>
  using PlaceOf = detail::PlaceAt<Id, N, Image>;
  template <std::size_t Id>
  constexpr auto& place() {
    return static_cast<PlaceOf<Id>&>(places_).places;
  }
  // Adds an effect at rest. Returns false where the model already has it as often as it can.
  template <class Effect>
  constexpr bool add(const typename Effect::template Coefficients<N>& coefficients) {
    auto& places = static_cast<detail::PlaceAt<id_of<Effect>(), N, Image>&>(places_).places;
    if (places.count == places.coefficients.size()) return false;
    places.coefficients[places.count] = coefficients;
    places.states[places.count] = {};
    ++places.count;
    note_effects();
    return true;
  }
  // No effects.
  constexpr void clear() {
    places_.for_each([]<class Effect>(auto& places) {
      places.count = 0;
      if constexpr (Image::kFilled || kRunsAlways<Effect>) places.coefficients = {};
    });
    note_effects();
    reset();
  }
  // Updates the set of present effects; call it after the memory of the places was filled.
  constexpr void note_effects() {
    has_scales_ = false;
    present_ = 0;
    reads_ = 0;
    places_.for_each([&]<class Effect>(auto& places) {
      if (places.count == 0 && !Image::kFilled) return;
      present_ |= std::uint64_t{1} << id_of<Effect>();
      // The signal that a table reads is one of its coefficients.
      reads_ |= Effect::kInfo.user_defined ? ~0U : Effect::kInfo.reads;
    });
  }
  // Sets which angles are known: effects that repeat with the motor's turn, or that depend on the output's angle, are
  // left out where that angle is not known. User-defined tables are left out as well, whichever signal they read.
  constexpr void note_effects(bool knows_turn, bool knows_output) {
    note_effects();
    places_.for_each([&]<class Effect>(auto&) {
      const bool needs_turn = Effect::kInfo.user_defined || is_periodic<Effect>();
      const bool needs_output = Effect::kInfo.user_defined || (Effect::kInfo.reads & effects::kOutputAngle) != 0;
      if ((needs_turn && !knows_turn) || (needs_output && !knows_output))
        present_ &= ~(std::uint64_t{1} << id_of<Effect>());
    });
  }
  // Whether an effect of the model reads one of these signals (effects::Signals).
  constexpr bool reads(unsigned signals) const { return Image::kFilled || (reads_ & signals) != 0; }
  // Calls visit.operator()<Effect>(places) for each effect that the image can run, by rising number.
  template <class Visit>
  constexpr void for_each(Visit&& visit) {
    places_.for_each(visit);
  }
  template <class Visit>
  constexpr void for_each(Visit&& visit) const {
    places_.for_each(visit);
  }
  // The state of rest: as after add().
  constexpr void reset() {
    places_.for_each([]<class Effect>(auto& places) {
      if constexpr (!std::is_empty_v<typename Effect::template State<N>>) detail::set_to_rest(places.states);
    });
    started_ = false;
    has_scales_ = false;
  }

  // One tick. `in` has measured values or set points: positions, velocities, accelerations, directions, torque,
  // current, temperature, all within two bases, to which the caller limits them once, at entry. Returns the torques of
  // the three balances. The first tick only stores the drive's position.
  constexpr effects::Torques<N> tick(const effects::Inputs<N>& in) { return tick(in, in.angle); }
  // The same with another angle for effects that repeat with it and have no memory (ripples): a model along a set point
  // may take periodic effects at the motor's measured angle.
  constexpr effects::Torques<N> tick(const effects::Inputs<N>& measured, typename N::Angle periodic_angle) {
    effects::Inputs<N> in;
    take(in, measured);
    const auto angle = in.angle;
    derive_inputs(in);
    shift(in, periodic_angle);
    modulate(in);
    // Not const: compilers keep constants in memory.
    effects::Inputs<N> before = remembered(in);
    effects::Torques<N> out{};
    if constexpr (!Image::kFilled && kOnDrive) {
      places_.for_each([&]<class Effect>(auto& places) {
        if constexpr (kRunsAlways<Effect>) Effect::evaluate(places.states[0], places.coefficients[0], in, out);
      });
    }
    for_each_present<kNotAlways>([&]<class Effect>(auto& places) {
      each_of<Effect>(places, [&](std::size_t i) {
        auto& state = places.states[i];
        const auto& coefficients = places.coefficients[i];
        in.angle = is_periodic<Effect>() ? periodic_angle : angle;
        Effect::advance(state, coefficients, in, before);
        if constexpr (Effect::kInfo.phase == effects::Phase::source || Effect::kInfo.adds_to != 0)
          Effect::evaluate(state, coefficients, in, out);
      });
    });
    in.angle = angle;
    remember(in);
    return out;
  }
  // The same, effect by effect, for a host that evaluates each: `visit` is called for every effect in order, with
  // operator()<Effect>(state, coefficients, in, before, out), and has to do what run<Effect>() does with these. tick()
  // does not use it: compilers would take twice the stack.
  template <class Visit>
  effects::Torques<N> tick_by_effect(const effects::Inputs<N>& measured, Visit&& visit) {
    effects::Inputs<N> in;
    take(in, measured);
    derive_inputs(in);
    shift(in, measured.angle);
    modulate(in);
    const effects::Inputs<N> before = remembered(in);
    effects::Torques<N> out{};
    places_.for_each([&]<class Effect>(auto& places) {
      for (std::size_t i = 0; i < places.count; ++i)
        visit.template operator()<Effect>(places.states[i], places.coefficients[i], in, before, out);
    });
    remember(in);
    return out;
  }
  template <class Effect>
  static void run(auto& state, const auto& coefficients, const effects::Inputs<N>& in, const effects::Inputs<N>& before,
                  effects::Torques<N>& out) {
    Effect::advance(state, coefficients, in, before);
    if constexpr (Effect::kInfo.phase == effects::Phase::source || Effect::kInfo.adds_to != 0)
      Effect::evaluate(state, coefficients, in, out);
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
  // Of the effects in `kAmong`, those that the model has.
  template <std::uint64_t kAmong, class Visit>
  constexpr void for_each_present(Visit&& visit) {
    if constexpr (Image::kFilled) {
      places_.for_each(visit);
    } else {
      places_.template for_each_present<kAmong>(present_, visit);
    }
  }
  static constexpr bool kOnDrive = std::is_base_of_v<fixed::Value, typename N::Value>;
  template <class Effect>
  static constexpr bool kRunsAlways = Effect::kInfo.runs_always;
  static constexpr std::uint64_t kNotAlways = [] {
    std::uint64_t others = ~std::uint64_t{0};
    effects::for_each_effect([&]<class Effect>(std::size_t id) {
      if (kOnDrive && kRunsAlways<Effect>) others &= ~(std::uint64_t{1} << id);
    });
    return others;
  }();
  template <effects::Phase phase>
  static constexpr std::uint64_t of_phase() {
    std::uint64_t found = 0;
    effects::for_each_effect([&]<class Effect>(std::size_t id) {
      if (Effect::kInfo.phase == phase) found |= std::uint64_t{1} << id;
    });
    return found;
  }
  template <class Effect, class P, class Visit>
  static constexpr void each_of(P& places, Visit&& visit) {
    constexpr std::size_t kPlaces = std::tuple_size_v<decltype(places.coefficients)>;
    if constexpr (Image::kFilled) {
      [&]<std::size_t... I>(std::index_sequence<I...>) {
        (visit(I), ...);
      }
      (std::make_index_sequence<kPlaces>{});
    } else if constexpr (kPlaces == 1) {
      visit(0);
    } else {
      for (std::size_t i = 0; i < places.count; ++i) visit(i);
    }
  }
  // One by one, so that signals that the image does not read are not copied.
  static constexpr void take(effects::Inputs<N>& in, const effects::Inputs<N>& from) {
    in.angle = from.angle;
    in.velocity = from.velocity;
    in.direction = from.direction;
    in.acceleration = from.acceleration;
    in.output_angle = from.output_angle;
    in.output_velocity = from.output_velocity;
    in.output_direction = from.output_direction;
    in.output_acceleration = from.output_acceleration;
    in.torsion = from.torsion;
    in.torsion_rate = from.torsion_rate;
    in.torsion_direction = from.torsion_direction;
    in.torque = from.torque;
    in.current = from.current;
    in.temperature = from.temperature;
  }
  static constexpr void derive_inputs(effects::Inputs<N>& in) {
    in.speed = N::magnitude(in.velocity);
    in.torque_magnitude = N::magnitude(in.torque);
    in.viscous_scale = N::one();
    in.coulomb_scale = N::one();
    in.elapsed = N::one();
  }
  // The dead zone of a backlash comes after everything else that changes the torsion.
  constexpr void shift(effects::Inputs<N>& in, typename N::Angle periodic_angle) {
    constexpr std::uint64_t kShifts = of_phase<effects::Phase::shift>();
    if (!Image::kFilled && (present_ & kShifts) == 0) return;
    shift_those<false>(in, periodic_angle);
    shift_those<true>(in, periodic_angle);
  }
  template <bool kLast>
  constexpr void shift_those(effects::Inputs<N>& in, typename N::Angle periodic_angle) {
    const auto angle = in.angle;
    for_each_present<of_phase<effects::Phase::shift>()>([&]<class Effect>(auto& places) {
      if constexpr (Effect::kInfo.phase == effects::Phase::shift && Effect::kInfo.acts_last == kLast)
        each_of<Effect>(places, [&](std::size_t i) {
          in.angle = is_periodic<Effect>() ? periodic_angle : angle;
          Effect::shift(places.coefficients[i], in);
        });
    });
    in.angle = angle;
  }
  // The modulating scales depend on the temperature only, which changes slowly: a tick with the temperature of the
  // previous one reuses its scales. The effects get no other signal here, so that this holds for each.
  constexpr void modulate(effects::Inputs<N>& in) {
    constexpr std::uint64_t kModulates = of_phase<effects::Phase::modulate>();
    const auto modulate_all = [&](effects::Inputs<N>& seen) {
      for_each_present<kModulates>([&]<class Effect>(auto& places) {
        if constexpr (Effect::kInfo.phase == effects::Phase::modulate)
          each_of<Effect>(places, [&](std::size_t i) { Effect::modulate(places.coefficients[i], seen); });
      });
    };
    if constexpr (kKeepsScales) {
      if ((present_ & kModulates) == 0) return;
      if (!has_scales_ || scales_.temperature != in.temperature) {
        effects::Inputs<N> seen;
        seen.temperature = in.temperature;
        seen.viscous_scale = seen.coulomb_scale = N::one();
        modulate_all(seen);
        scales_ = {seen.temperature, seen.viscous_scale, seen.coulomb_scale};
        has_scales_ = true;
      }
      in.viscous_scale = scales_.viscous;
      in.coulomb_scale = scales_.coulomb;
    } else {
      modulate_all(in);
    }
  }

  // Whether an effect of the model reads signals of the previous tick.
  constexpr bool has_memory() const {
    constexpr std::uint64_t kWithMemory = [] {
      std::uint64_t found = 0;
      effects::for_each_effect([&]<class Effect>(std::size_t id) {
        if (!std::is_empty_v<typename Effect::template State<N>>) found |= std::uint64_t{1} << id;
      });
      return found;
    }();
    return Image::kFilled || (present_ & kWithMemory) != 0;
  }

  using All = detail::AllPlaces<N, Image, std::make_index_sequence<effects::kLastId + 1>>;
  // Signals of the previous tick that effects with memory may read: angle, torsion, magnitude of the torque, current.
  static constexpr unsigned kRemembered = All::remembered();
  template <unsigned kSignal, class T>
  using Kept = typename detail::Slot<(kRemembered & kSignal) != 0, T>::Type;
  struct Remembered {
    [[no_unique_address]] Kept<effects::kMotorAngle, typename N::Angle> angle{};
    [[no_unique_address]] Kept<effects::kTorsion, typename N::Value> torsion{};
    [[no_unique_address]] Kept<effects::kTorque, typename N::Value> torque_magnitude{};
    [[no_unique_address]] Kept<effects::kCurrent, typename N::Value> current{};
  };
  constexpr void remember(const effects::Inputs<N>& in) {
    if (!has_memory()) return;
    if constexpr ((kRemembered & effects::kMotorAngle) != 0) memory_.angle = in.angle;
    if constexpr ((kRemembered & effects::kTorsion) != 0) memory_.torsion = in.torsion;
    if constexpr ((kRemembered & effects::kTorque) != 0) memory_.torque_magnitude = in.torque_magnitude;
    if constexpr ((kRemembered & effects::kCurrent) != 0) memory_.current = in.current;
  }
  constexpr effects::Inputs<N> remembered(const effects::Inputs<N>& now) {
    if (!has_memory()) return {};
    if constexpr (kRemembered != 0) {
      if (!started_) {
        remember(now);
        started_ = true;
      }
    }
    effects::Inputs<N> before{};
    if constexpr ((kRemembered & effects::kMotorAngle) != 0) before.angle = memory_.angle;
    if constexpr ((kRemembered & effects::kTorsion) != 0) before.torsion = memory_.torsion;
    if constexpr ((kRemembered & effects::kTorque) != 0) before.torque_magnitude = memory_.torque_magnitude;
    if constexpr ((kRemembered & effects::kCurrent) != 0) before.current = memory_.current;
    return before;
  }

  All places_;
  std::uint64_t present_ = 0;  // bits of the effects' numbers
  unsigned reads_ = 0;
  // For the last temperature, on a drive. Other number systems cannot compare temperatures, and an image that runs all
  // its effects at every tick makes no check.
  static constexpr bool kKeepsScales = !Image::kFilled && kOnDrive;
  struct Scales {
    typename N::Value temperature{};
    typename N::Value viscous{};
    typename N::Value coulomb{};
  };
  Scales scales_{};
  bool has_scales_ = false;
  Remembered memory_{};
  bool started_ = false;
};

}  // namespace flexspline::model
