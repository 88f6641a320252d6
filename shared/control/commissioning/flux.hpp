// The flux linkage, from the voltage that the rotor induces at two speeds, one in each direction. In the rotor's axes
//   v_q = R i_q + w (L_d i_d + flux) + L_q d(i_q)/dt,   the last with the mean zero over a window
// with in q what holds the speed: proportional to what is missing of it, all of the test current for half of it. In d
// half of the test current against the flux: so a leg's losses are known, as its current is far from zero most of
// the time, and reluctance helps where it is large. R is that of the moment, as the winding is warm by now: from
//   v_d = R i_d - w L_q i_q
#pragma once

#include <cstdint>

#include "shared/control/commissioning/context.hpp"
#include "shared/control/commissioning/rotation.hpp"

namespace flexspline::control::commissioning {

class FluxTest {
 public:
  constexpr Step step() const { return step_; }
  constexpr bool done() const { return step_ == Step::stop && reference_.step() == 0 && part_ == Part::measure; }

  constexpr foc::RotorVector wanted(const Context& c) const { return {-(c.settings.current / 2), driving(c)}; }
  // Of the rotor in a period, 2^-32 turns.
  constexpr std::uint32_t ahead(const Context& c) const { return static_cast<std::uint32_t>(speed(c)); }

  // Current and voltage of the motor in the rotor's axes, and what the loop asks for.
  constexpr void update(Context& c, const foc::RotorVector& current, const foc::RotorVector& voltage,
                        const foc::RotorVector& asked) {
    speed_ += (std::int64_t{c.now.moved} << kFilterBits) - (speed_ >> kFilterBits);
    if (step_ == Step::stop) {
      if (reference_.step() == 0) part_ = Part::measure;
    } else if (part_ == Part::faster) {
      faster(c, asked);
    } else if (part_ == Part::even) {
      if (++count_ >= kEvenPeriods) go(Part::measure);
    } else {
      measure(c, current, voltage);
    }
    const std::int32_t target = step_ == Step::stop ? 0 : step_ == Step::flux_backward ? -reached_ : reached_;
    reference_.advance(target, c.settings.step_ramp);
  }

 private:
  enum class Part : std::uint8_t { faster, even, measure };
  static constexpr std::int32_t kEvenPeriods = 2048;
  static constexpr int kWindowBits = 12;
  static constexpr int kFilterBits = 4;  // of the speed: periods
  static constexpr int kShareBits = 12;

  constexpr void go(Part part) {
    part_ = part;
    count_ = 0;
  }
  constexpr std::int32_t driving(const Context& c) const {
    const std::int32_t missing = reference_.step() - speed(c);
    const std::int32_t whole = highest(c) / 2;
    const std::int32_t share = fixed::limited(missing, -whole, whole);
    return static_cast<std::int32_t>(std::int64_t{c.settings.current >> kShareBits} *
                                     (share / (whole >> kShareBits > 0 ? whole >> kShareBits : 1)));
  }
  constexpr std::int32_t speed(const Context& c) const {
    const auto moved = static_cast<std::int32_t>(speed_ >> (2 * kFilterBits));
    return (c.result.reversed ? -moved : moved) * c.result.pole_pairs;
  }
  static constexpr std::int32_t highest(const Context& c) {
    const std::int64_t by_shaft = std::int64_t{c.settings.most_shaft_step} * c.result.pole_pairs;
    return by_shaft < c.settings.fast_step ? static_cast<std::int32_t>(by_shaft) : c.settings.fast_step;
  }
  // Forward until one of the limits; back at the same speed.
  constexpr void faster(const Context& c, const foc::RotorVector& asked) {
    if (step_ == Step::flux_backward) {
      if (reference_.step() == -reached_) go(Part::even);
      return;
    }
    const std::int32_t most = c.settings.most_voltage - c.settings.most_voltage / 8;
    const bool at_voltage = size(asked.d) > most || size(asked.q) > most;
    // What the acceleration needs of the voltage passes.
    const bool holds = at_voltage && reference_.step() > c.settings.slow_step;
    reached_ = holds ? reference_.step() : highest(c);
    count_ = holds ? count_ + 1 : 0;
    if (reference_.step() == highest(c) || count_ == kEvenPeriods) go(Part::even);
  }
  constexpr void measure(Context& c, const foc::RotorVector& current, const foc::RotorVector& voltage) {
    if (count_ == 0) window_ = {};
    window_.voltage.add(voltage);
    window_.current.add(current);
    if (count_ > 0) window_.turned += c.now.moved;
    if (++count_ <= (1 << kWindowBits)) return;
    // A load that the test current hardly turns, or an encoder that slipped meanwhile.
    const std::int64_t turned = window_.turned * c.result.pole_pairs * (c.result.reversed ? -1 : 1);
    const std::int64_t wanted = std::int64_t{reference_.step()} << kWindowBits;
    if ((turned < 0) != (wanted < 0) || 2 * fixed::size_of(turned) < fixed::size_of(wanted))
      return c.fail(Fault::rotor_blocked);
    const auto mean = [](std::int64_t x) { return static_cast<std::int32_t>(x >> kWindowBits); };
    const foc::RotorVector v = {mean(window_.voltage.d), mean(window_.voltage.q)};
    const foc::RotorVector i = {mean(window_.current.d), mean(window_.current.q)};
    const auto speed = static_cast<std::int32_t>(turned >> kWindowBits);
    const std::int32_t induced_d = scaled(linkage(c.result.inductance_q, i.q), speed, 32 - 28 + kSharesBits);
    const std::int32_t warm = ratio(std::int64_t{v.d} + induced_d, i.d, kSharesBits - 1);
    induced_ = std::int64_t{v.q} - scaled(warm, i.q, kSharesBits - 1) - induced_;
    turned_ = speed - turned_;
    along_ += i.d / 2;
    if (step_ == Step::flux_forward) {
      step_ = Step::flux_backward;
      return go(Part::faster);
    }
    // Both are differences now; voltages in 2^-28, speeds in 2^-32 turns a period.
    c.result.flux = ratio(induced_, turned_, 32 - 28 + kSharesBits) - linkage(c.result.inductance_d, along_);
    step_ = Step::stop;
    go(Part::faster);
  }

  // Of a current, for a turn.
  static constexpr std::int32_t linkage(std::int32_t inductance, std::int32_t current) {
    constexpr std::int32_t kTwoPi = 1686629713;  // 2^-28
    return scaled(scaled(inductance, current, 27), kTwoPi, 28);
  }

  struct Window {
    VectorSum voltage;
    VectorSum current;
    std::int64_t turned = 0;  // of the encoder
  };
  TurningVector reference_;  // its step is the speed that is wanted
  Step step_ = Step::flux_forward;
  Part part_ = Part::faster;
  std::int32_t count_ = 0;
  std::int32_t reached_ = 1;
  std::int64_t speed_ = 0;  // of the encoder, filtered: 2^-40 turns
  Window window_;
  std::int64_t induced_ = 0;
  std::int64_t turned_ = 0;
  std::int32_t along_ = 0;
};

}  // namespace flexspline::control::commissioning
