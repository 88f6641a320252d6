// The proof that a drive model cannot leave the range of its numbers: one run with intervals covers all runs with
// numbers. For the host.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "shared/fixed/intervals.hpp"
#include "shared/model/drive_model.hpp"

namespace flexspline::model {

// Signals are limited to this many bases where they enter the model.
inline constexpr std::int32_t kEnvelopeBases = 2;

struct Proof {
  bool holds = false;
  std::string_view reason{};                     // the first violation, where it does not hold
  effects::Torques<fixed::Intervals> torques{};  // bounds of the model's torques
};

namespace detail {
// Widens the states of an effect by their previous ranges; true where that changed them. A state consists of ranges
// only.
template <class State>
bool keep_hull(const State& before, State& after) {
  if constexpr (std::is_empty_v<State>) {
    return false;
  } else {
    struct Ends {
      std::int64_t low, high;
    };
    using All = std::array<Ends, sizeof(State) / sizeof(Ends)>;
    static_assert(sizeof(All) == sizeof(State));
    const auto old = std::bit_cast<All>(before);
    auto now = std::bit_cast<All>(after);
    bool changed = false;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (old[i].low < now[i].low) now[i].low = old[i].low;
      if (old[i].high > now[i].high) now[i].high = old[i].high;
      changed = changed || now[i].low != old[i].low || now[i].high != old[i].high;
    }
    after = std::bit_cast<State>(now);
    return changed;
  }
}

inline effects::Inputs<fixed::Intervals> envelope() {
  constexpr std::int64_t kMost = std::int64_t{kEnvelopeBases} << fixed::kValueBits;
  constexpr std::int64_t kOne = std::int64_t{1} << fixed::kValueBits;
  const fixed::Intervals::Value signal{-kMost, kMost};
  const fixed::Intervals::Value direction{-kOne, kOne};
  effects::Inputs<fixed::Intervals> in;
  in.velocity = in.acceleration = in.output_velocity = in.output_acceleration = signal;
  in.torsion = in.torsion_rate = in.torque = in.current = in.temperature = signal;
  in.direction = in.output_direction = in.torsion_direction = direction;
  return in;
}
}  // namespace detail

// Proves that no value, state or torque leaves its range for any inputs within the envelope, however long the model
// runs: its states are widened tick by tick until a tick no longer widens them, which is then an invariant. `model`
// must be at rest, and its coefficients made without an entry in OverflowLog.
inline Proof prove(DriveModel<fixed::Intervals> model) {
  constexpr int kMostTicks = 100;
  fixed::OverflowLog::clear();
  const effects::Inputs<fixed::Intervals> inputs = detail::envelope();
  Proof proof;
  for (int tick = 0; tick < kMostTicks; ++tick) {
    DriveModel<fixed::Intervals> before = model;
    proof.torques = model.tick(inputs);
    bool changed = false;
    // Both visits meet the effects in the same order.
    std::array<const void*, effects::kLastId + 1> old{};
    std::size_t at = 0;
    before.for_each([&]<class Effect>(auto& places) { old[at++] = &places.states; });
    at = 0;
    model.for_each([&]<class Effect>(auto& places) {
      using States = decltype(places.states);
      const States& states = *static_cast<const States*>(old[at++]);
      for (std::size_t i = 0; i < places.count; ++i)
        changed = detail::keep_hull(states[i], places.states[i]) || changed;
    });
    if (fixed::OverflowLog::count() != 0) {
      proof.reason = fixed::OverflowLog::first();
      return proof;
    }
    if (!changed) {
      proof.holds = true;
      return proof;
    }
  }
  proof.reason = "a state grows without a bound";
  return proof;
}

}  // namespace flexspline::model
