#include "host/drive_link/deployment/error_proof.hpp"

#include <algorithm>
#include <bit>
#include <type_traits>

#include "host/drive_link/deployment/error_numbers.hpp"
#include "host/drive_link/deployment/on_numbers.hpp"

namespace flexspline::deployment {

thread_local std::string ProofFailure::reason_;

namespace {

using Numbers = ErrorNumbers;
using Any = Numbers::Value;

constexpr double kEnvelope = 2.0;  // bases
constexpr int kTorsionSignal = 1;
// What double itself rounds, of each torque and of a base.
constexpr double kOfDouble = 0x1p-36;
// Errors that still grow by less than this share in a tick are a twentieth below what they come to at most, where a
// state forgets a 50,000th of itself in a tick or more; that they then grow no more is checked.
constexpr double kSettled = 1e-6;
constexpr double kMargin = 1.05;
constexpr int kMostTicks = 300'000;

effects::Inputs<Numbers> envelope(const effects::DriveConstants<double>& d) {
  const Any signal{-kEnvelope, kEnvelope}, direction{-1.0, 1.0};
  effects::Inputs<Numbers> in;
  in.velocity = in.acceleration = in.output_velocity = in.output_acceleration = signal;
  in.torsion = in.torsion_rate = in.torque = in.current = in.temperature = signal;
  in.direction = in.output_direction = in.torsion_direction = direction;
  in.torsion.signal = kTorsionSignal;
  const double step = kEnvelope * d.velocity_base * d.time_base / d.angle_base + 2.0 * Numbers::kPhaseUnit;
  in.angle = in.output_angle = {kMostTurns, step};
  return in;
}

// A state is made of such numbers and of nothing else.
struct Plain {
  double low, high, error;
  int signal;
  bool constant;
};
static_assert(sizeof(Plain) == sizeof(Any));
template <class State>
using PlainState = std::array<Plain, sizeof(State) / sizeof(Plain)>;

struct Growth {
  bool changed = false;  // by more than settling
  bool grown = false;    // at all
};
// Widens a state to what it was before.
template <class State>
void keep_hull(const State& before, State& after, Growth& growth) {
  if constexpr (!std::is_empty_v<State>) {
    const auto old = std::bit_cast<PlainState<State>>(before);
    auto now = std::bit_cast<PlainState<State>>(after);
    for (std::size_t i = 0; i < now.size(); ++i) {
      const bool wider = now[i].low < old[i].low || now[i].high > old[i].high;
      growth.grown = growth.grown || wider || now[i].error > old[i].error;
      growth.changed = growth.changed || wider || now[i].error > old[i].error * (1.0 + kSettled);
      now[i].low = std::min(now[i].low, old[i].low);
      now[i].high = std::max(now[i].high, old[i].high);
      now[i].error = std::max(now[i].error, old[i].error);
    }
    after = std::bit_cast<State>(now);
  }
}
template <class State>
void widen_error(State& state) {
  if constexpr (!std::is_empty_v<State>) {
    auto all = std::bit_cast<PlainState<State>>(state);
    for (Plain& one : all) one.error *= kMargin;
    state = std::bit_cast<State>(all);
  }
}

}  // namespace

ErrorProof prove_error(const std::vector<EffectValues>& effects, const effects::DriveConstants<double>& drive) {
  using Model = model::DriveModel<Numbers>;
  const auto model = model_of<Numbers>(effects, drive);
  const effects::Inputs<Numbers> inputs = envelope(drive);
  ErrorProof proof;
  for (const EffectValues& e : effects) proof.parts.push_back({e.id, {}, {}});
  VisitedEffects visited(effects);
  // One tick from all states so far; what they grew by.
  const auto tick = [&] {
    Growth growth;
    visited.start();
    model->tick_by_effect(
        inputs, [&]<class Effect>(auto& state, const auto& coefficients, const effects::Inputs<Numbers>& in,
                                  const effects::Inputs<Numbers>& before, effects::Torques<Numbers>&) {
          ErrorPart& part = proof.parts[visited.next(Model::template number_of<Effect>())];
          ProofFailure::clear();
          effects::Torques<Numbers> out{};
          const auto old = state;
          Effect::advance(state, coefficients, in, before);
          Growth of_part;
          keep_hull(old, state, of_part);
          if constexpr (Effect::kInfo.phase == effects::Phase::source || Effect::kInfo.adds_to != 0)
            Effect::evaluate(state, coefficients, in, out);
          const auto bound = [](const Numbers::Sum& sum) {
            return sum.most() == 0.0 && sum.error == 0.0 ? 0.0 : sum.error + kOfDouble * (1.0 + sum.most());
          };
          part.bound = {bound(out.motor), bound(out.transmission), bound(out.load)};
          part.unproven = ProofFailure::reason();
          if (!part.unproven.empty()) return;
          growth.grown = growth.grown || of_part.grown;
          growth.changed = growth.changed || of_part.changed;
        });
    return growth;
  };
  const auto all_unproven = [&](const char* reason) {
    for (ErrorPart& part : proof.parts)
      if (part.unproven.empty()) part.unproven = reason;
  };
  for (int k = 0;; ++k) {
    const Growth growth = tick();
    if (k == kMostTicks) {
      all_unproven("what it rounds is forgotten too slowly, or never");
      break;
    }
    if (!growth.grown) break;
    if (growth.changed) continue;
    model->for_each([]<class Effect>(auto& places) {
      for (std::size_t i = 0; i < places.count; ++i) widen_error(places.states[i]);
    });
  }
  for (const ErrorPart& part : proof.parts) {
    proof.holds = proof.holds && part.unproven.empty();
    for (std::size_t b = 0; b < proof.sum.size(); ++b) proof.sum[b] += part.bound[b];
  }
  return proof;
}

}  // namespace flexspline::deployment
