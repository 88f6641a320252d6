// Excitations for identification (report sections 3.5 and 4.2.2): a set point of torque or velocity that moves a drive
// so that its parameters can be identified. Phases are integers of 2^-64 turns on the host and on the drive, so that
// both have exactly the same phases at every tick.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shared/control/excitation_setup.hpp"
#include "shared/control/limits.hpp"
#include "shared/effects/effect.hpp"

namespace flexspline::control {

namespace detail {
// Cycles a tick as 2^-64 turns.
template <class P>
std::uint64_t phase_step(const P& frequency_hz, const P& tick_s) {
  const P cycles = frequency_hz * tick_s;
  const bool fits = cycles >= P(0.0) && cycles < P(0.5);
  require(fits, "an excitation has to stay below half the rate of ticks");
  return fits ? static_cast<std::uint64_t>(static_cast<double>(cycles) * 0x1p64) : 0;
}
}  // namespace detail

struct Excitation {
  template <class N>
  struct DriveLine {
    std::uint16_t harmonic = 0;
    std::uint32_t phase = 0;
    typename N::Gain amplitude{};
    template <class Codec>
    constexpr void fields(Codec& c) {
      c.harmonics(harmonic), c.number(phase), c(amplitude);
    }
  };
  // All of an excitation but its lines.
  template <class N>
  struct Waveform {
    Shape shape = Shape::lines;
    bool guarded = false;
    std::uint8_t line_count = 0;
    std::uint64_t step = 0;         // 2^-64 turns
    std::uint64_t step_change = 0;  // a tick, of a chirp; two's complement
    std::uint32_t ticks = 0;
    std::uint32_t fade_ticks = 0;
    std::uint64_t fade_step = 0;  // 2^-64 of the fade
    RateLimiter::Coefficients<N> limiter{};
    typename N::Value positive{};
    typename N::Value negative{};
    typename N::Value offset{};
    SpeedGuard::Coefficients<N> guard{};  // zero where it is not guarded
    template <class Codec>
    constexpr void fields(Codec& c) {
      c.shape(shape), c(guarded), c.lines(line_count), c.wide(step), c.wide(step_change);
      c.ticks_or_none(ticks), c.ticks_or_none(fade_ticks), c.share(fade_step), c.limit(limiter.limit), c(limiter.rate);
      c(positive), c(negative), c(offset);
      c(guard.torque_limit), c(guard.overspeed), c(guard.largest_velocity), c(guard.slope);
    }
  };
  template <class N>
  struct Coefficients : Waveform<N> {
    std::array<DriveLine<N>, kMostLines> lines{};
  };
  template <class N>
  struct State {
    std::uint32_t tick = 0;
    std::uint64_t phase = 0;
    std::uint64_t step = 0;
    RateLimiter::State<N> limiter{};
    bool running = false;
  };

  // Host only. `base` is the set point's base, torque_base or velocity_base of `d`; all limits are within two of it.
  template <class N, class P>
  static Coefficients<N> derive(const ExcitationSetup<P>& setup, const P& base, const effects::DriveConstants<P>& d) {
    Coefficients<N> c;
    c.shape = setup.shape;
    c.step = detail::phase_step(setup.frequency_hz, d.time_base);
    require(setup.ticks > 0 && setup.fade_ticks <= setup.ticks / 2, "an excitation is shorter than its two fades");
    c.ticks = setup.ticks;
    c.fade_ticks = setup.fade_ticks;
    if (setup.fade_ticks > 1) c.fade_step = ~std::uint64_t{0} / setup.fade_ticks;
    if (setup.end_frequency_hz >= P(0.0)) add_chirp(c, setup, d.time_base);
    const P negative =
        setup.shape == Shape::asymmetric_sine ? setup.negative_per_positive * setup.amplitude : setup.amplitude;
    c.positive = N::value(setup.amplitude / base);
    c.negative = N::value(negative / base);
    c.offset = N::value(setup.offset / base);
    add_lines(c, setup, base);
    const P largest = negative > setup.amplitude ? negative : setup.amplitude;
    const P offset = setup.offset < P(0.0) ? -setup.offset : setup.offset;
    require(largest + offset <= setup.limit, "an excitation exceeds its own limit and would be clipped");
    c.limiter = RateLimiter::derive<N>(setup.limit, setup.slope_limit, base, d.time_base);
    c.guarded = setup.velocity_limit > P(0.0);
    if (c.guarded) {
      c.guard = SpeedGuard::derive<N>(setup.limit / base, setup.velocity_limit / d.velocity_base,
                                      setup.overspeed / d.velocity_base);
    }
    return c;
  }

  // Whether every sum of its numbers stays in range. For what comes in a block and for what a host sends; of the
  // drive's own number system.
  template <class N>
  static constexpr bool is_valid(const Waveform<N>& c) {
    const std::int64_t largest_rate = 4 * N::widen(N::one()).raw;
    const auto is_signal = [](const typename N::Value& x) { return x.raw >= -two<N>() && x.raw <= two<N>(); };
    return c.fade_ticks <= c.ticks / 2 && is_signal(c.positive) && is_signal(c.negative) && is_signal(c.offset) &&
           is_limit<N>(c.limiter.limit) && c.limiter.rate.raw > 0 && c.limiter.rate.raw <= largest_rate &&
           (c.shape != Shape::lines || c.line_count > 0) && (!c.guarded || is_valid_guard<N>(c.guard));
  }
  template <class N>
  static constexpr bool is_valid_guard(const SpeedGuard::Coefficients<N>& g) {
    return is_limit<N>(g.torque_limit) && is_limit<N>(g.overspeed) && g.largest_velocity.raw > 0 &&
           g.slope.mantissa > 0;
  }

  template <class N>
  static constexpr void start(State<N>& s, const Coefficients<N>& c) {
    s = {0, 0, c.step, s.limiter, true};
  }
  // Ends it early; the set point goes to zero with the largest slope.
  template <class N>
  static constexpr void stop(State<N>& s) {
    s.running = false;
  }
  // One tick: returns the set point, in bases. `velocity` is the measured one, used where the excitation is guarded.
  template <class N>
  static constexpr typename N::Value update(State<N>& s, const Coefficients<N>& c, typename N::Value velocity) {
    if (s.running && s.tick >= c.ticks) s.running = false;
    typename N::Value set_point{};
    if (s.running) {
      set_point = faded<N>(s, c, c.offset + shape<N>(s, c));
      if (c.guarded) {
        const auto bounds = SpeedGuard::bounds<N>(c.guard, velocity);
        set_point = N::between(set_point, bounds.low, bounds.high);
      }
      s.phase += s.step;
      s.step += c.step_change;
      ++s.tick;
    }
    return RateLimiter::update<N>(s.limiter, c.limiter, set_point);
  }
  // True once it has ended and the set point is back at zero.
  template <class N>
  static constexpr bool finished(const State<N>& s) {
    return !s.running && N::narrow(s.limiter.output) == typename N::Value{};
  }

 private:
  template <class N>
  static constexpr std::int32_t two() {
    return (N::one() + N::one()).raw;
  }
  template <class N>
  static constexpr bool is_limit(const typename N::Value& x) {
    return x.raw > 0 && x.raw <= two<N>();
  }
  // The phase after k ticks is that of the continuous chirp, f k + (f_end - f) k^2 / (2 ticks).
  template <class N, class P>
  static void add_chirp(Coefficients<N>& c, const ExcitationSetup<P>& setup, const P& tick_s) {
    const std::uint64_t last = detail::phase_step(setup.end_frequency_hz, tick_s);
    const auto change = static_cast<std::int64_t>(last - c.step) / static_cast<std::int64_t>(setup.ticks);
    c.step_change = static_cast<std::uint64_t>(change);
    c.step += static_cast<std::uint64_t>(change / 2);
  }
  template <class N, class P>
  static void add_lines(Coefficients<N>& c, const ExcitationSetup<P>& setup, const P& base) {
    if (setup.shape != Shape::lines) return;
    require(setup.line_count > 0 && setup.line_count <= kMostLines, "an excitation has no lines, or too many");
    const std::uint64_t highest = detail::highest_harmonic(setup);
    require((c.step >> 1) < (std::uint64_t{1} << 62) / highest && highest < 32768,
            "the highest line of an excitation has to stay below half the rate of ticks");
    const P peak = detail::peak_of_lines(setup);
    c.line_count = static_cast<std::uint8_t>(setup.line_count);
    for (std::size_t i = 0; i < setup.line_count; ++i) {
      const Line<P>& line = setup.lines[i];
      c.lines[i] = {line.harmonic, line.phase, N::gain(setup.amplitude * line.weight / (peak * base))};
    }
  }

  template <class N>
  static constexpr typename N::Value shape(const State<N>& s, const Coefficients<N>& c) {
    const auto phase = static_cast<std::uint32_t>(s.phase >> 32);
    switch (c.shape) {
      case Shape::lines: {
        typename N::Sum sum{};
        for (std::size_t i = 0; i < c.line_count; ++i) {
          const DriveLine<N>& line = c.lines[i];
          const std::uint64_t turns = line.harmonic * s.phase;
          sum += line.amplitude * N::wave(static_cast<std::uint32_t>(turns >> 32) + line.phase).sine;
        }
        return N::narrow(sum);
      }
      case Shape::asymmetric_sine: {
        const auto sine = N::wave(phase).sine;
        return N::times(N::by_sign(sine, c.positive, c.negative), sine);
      }
      case Shape::square:
        return phase < 2 * kQuarterTurn ? c.positive : -c.positive;
      case Shape::saw_tooth:
        return N::times(c.positive, N::value_of(2 * std::int64_t{static_cast<std::int32_t>(phase)}));
      case Shape::triangle: {
        // From -1 at a quarter turn before the start up to 1 at half a turn later, and down again.
        const std::uint32_t from_lowest = phase + kQuarterTurn;
        const std::uint32_t folded = from_lowest <= 2 * kQuarterTurn ? from_lowest : 0 - from_lowest;
        return N::times(c.positive, N::value_of(4 * std::int64_t{folded} - (std::int64_t{1} << 32)));
      }
    }
    return {};
  }
  template <class N>
  static constexpr typename N::Value faded(const State<N>& s, const Coefficients<N>& c, typename N::Value x) {
    const std::uint32_t left = c.ticks - s.tick;
    const std::uint32_t at = s.tick < left ? s.tick : left;
    if (at >= c.fade_ticks) return x;
    const auto part = N::value_of(static_cast<std::int64_t>((at * c.fade_step) >> 32));
    const auto three_less_two = N::one() + N::one() + N::one() - part - part;
    return N::times(x, N::times(N::times(part, part), three_less_two));
  }
};

}  // namespace flexspline::control
