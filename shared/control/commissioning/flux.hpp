// The flux linkage, from the voltage that the rotor induces at speed, both ways, each with the test current's half in d
// of one sign and then of the other. In the rotor's axes
//   v_q = R i_q + w (L_d i_d + flux) + L_q d(i_q)/dt,   the last with the mean zero over a window
//   v_d = R i_d - w L_q i_q
// with in q what holds the speed: proportional to what is missing of it, all of the test current for half of it.
// A leg whose current is near zero in its dead time floats, and what it loses no longer follows from the sample (zero
// current clamping; Choi and Sul, IEEE Trans. Power Electronics 11(2), 1996). So the legs' losses do not turn quite
// with the current, and a part of them across it looks like flux. It has the sign of i_d, as has what is wrong in
// L_d i_d: the mean of both signs is without them, and R is that of their difference, as the winding is warm by now.
// First comes the sign with which reluctance helps. The other current is smaller where it takes much of the torque.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "shared/control/commissioning/context.hpp"
#include "shared/control/commissioning/rotation.hpp"

namespace flexspline::control::commissioning {

class FluxTest {
 public:
  constexpr Step step() const { return step_; }
  constexpr bool done() const { return step_ == Step::stop && reference_.step() == 0 && part_ == Part::measure; }

  constexpr void begin(const Context& c) {
    *this = {};
    along_ = helping(c);
  }
  constexpr foc::RotorVector wanted(const Context& c) const { return {along_, driving(c)}; }
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
  struct Means {
    foc::RotorVector voltage;
    foc::RotorVector current;
    std::int32_t speed = 0;  // electrical, 2^-32 turns a period
  };
  static constexpr std::int32_t kEvenPeriods = 2048;
  static constexpr int kWindowBits = 11;
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
    // With what comes to it where d changes against the flux first.
    const std::int32_t rise =
        along_ < 0 ? induced_voltage(c.result.inductance_d, c.settings.current, reference_.step()) : 0;
    const std::int32_t most = c.settings.most_voltage - c.settings.most_voltage / 8;
    const bool at_voltage = size(asked.d) > most || std::int64_t{size(asked.q)} + rise > most;
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
    const Means seen = {{mean(window_.voltage.d), mean(window_.voltage.q)},
                        {mean(window_.current.d), mean(window_.current.q)},
                        static_cast<std::int32_t>(turned >> kWindowBits)};
    if (!other_sign_) {
      first_ = seen;
      other_sign_ = true;
      along_ = opposite(c, seen);
      return go(Part::even);
    }
    add(c, seen);
    other_sign_ = false;
    along_ = helping(c);
    if (step_ == Step::flux_forward) {
      step_ = Step::flux_backward;
      return go(Part::faster);
    }
    c.result.flux = ratio(induced_, turned_, 32 - 28 + kSharesBits);
    step_ = Step::stop;
    go(Part::faster);
  }
  // With this current in d reluctance adds to the magnet's torque.
  static constexpr std::int32_t helping(const Context& c) {
    const std::int32_t half = c.settings.current / 2;
    return c.result.inductance_d > c.result.inductance_q ? half : -half;
  }
  // With this one of the other sign it leaves at least three quarters of it.
  static constexpr std::int32_t opposite(const Context& c, const Means& seen) {
    const std::int64_t all =
        std::int64_t{seen.voltage.q} - scaled(c.result.resistance, seen.current.q, kSharesBits - 1);
    const std::int64_t flux =
        std::int64_t{ratio(all, seen.speed, 32 - 28 + kSharesBits)} - linkage(c.result.inductance_d, seen.current.d);
    const std::int32_t half = c.settings.current / 2, least = c.settings.current / 8;
    const std::int32_t reluctance = size(linkage(c.result.inductance_d - c.result.inductance_q, half));
    const std::int32_t most = scaled(ratio(flux / 4, reluctance, 16), half, 16);
    const std::int32_t held = fixed::limited(most, least, half);
    return helping(c) > 0 ? -held : held;
  }
  constexpr void add(const Context& c, const Means& seen) {
    const auto along_d = [&](const Means& m) {
      return std::int64_t{m.voltage.d} + induced_voltage(c.result.inductance_q, m.current.q, m.speed);
    };
    const std::int32_t warm =
        ratio(along_d(first_) - along_d(seen), std::int64_t{first_.current.d} - seen.current.d, kSharesBits - 1);
    const int sign = step_ == Step::flux_forward ? 1 : -1;
    for (const Means& m : {first_, seen}) {
      induced_ += sign * (std::int64_t{m.voltage.q} - scaled(warm, m.current.q, kSharesBits - 1) -
                          induced_voltage(c.result.inductance_d, m.current.d, m.speed));
      turned_ += sign * std::int64_t{m.speed};
    }
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
  std::int32_t along_ = 0;   // wanted in d
  bool other_sign_ = false;  // of it
  Means first_;
  std::int64_t induced_ = 0;  // voltages in 2^-28, forward less backward
  std::int64_t turned_ = 0;   // likewise, 2^-32 turns
};

}  // namespace flexspline::control::commissioning
