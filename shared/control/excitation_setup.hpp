// Setups of excitations on the host: shapes, the signals of the report, multi-sines.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "shared/control/limits.hpp"
#include "shared/fixed/elementary.hpp"

namespace flexspline::control {

// The shape of a cycle. All start at zero, rising, except lines with phases of their own.
enum class Shape : std::uint8_t { lines, asymmetric_sine, square, saw_tooth, triangle };

inline constexpr std::size_t kMostLines = 32;
inline constexpr std::uint32_t kQuarterTurn = std::uint32_t{1} << 30;  // phases of lines count 2^-32 turns

// A sine of `harmonic` cycles to a cycle of the excitation; `weight` relative to the other lines.
template <class P>
struct Line {
  std::uint16_t harmonic = 1;
  std::uint32_t phase = 0;
  P weight{1.0};
};

// In the unit of the set point (N m or rad/s at the motor), seconds and hertz. The first block is the demand, the
// second has limits that are never exceeded.
template <class P>
struct ExcitationSetup {
  Shape shape = Shape::lines;
  P amplitude{};                 // largest magnitude; of the positive half where halves differ
  P negative_per_positive{1.2};  // amplitude of the negative half of an asymmetric sine over the positive one's
  P offset{};
  P frequency_hz{};          // of the cycle
  P end_frequency_hz{-1.0};  // of a linear chirp; below zero: the frequency stays
  std::uint32_t ticks = 0;
  std::uint32_t fade_ticks = 0;  // at either end: 3 x^2 - 2 x^3
  std::size_t line_count = 0;
  std::array<Line<P>, kMostLines> lines{};

  P limit{};           // of the set point
  P slope_limit{};     // per second: acceleration where the set point is a velocity
  P velocity_limit{};  // rad/s measured, where the set point is a torque: see SpeedGuard; zero: not guarded
  P overspeed{};       // rad/s
};

// The signals of the report. Where it gives no amplitudes the caller sets them.
template <class P>
ExcitationSetup<P> with_lines(ExcitationSetup<P> setup, std::initializer_list<Line<P>> lines) {
  setup.shape = Shape::lines;
  setup.line_count = 0;
  for (const Line<P>& line : lines) setup.lines[setup.line_count++] = line;
  return setup;
}
template <class P>
ExcitationSetup<P> sine(const ExcitationSetup<P>& setup) {
  return with_lines<P>(setup, {{}});
}
// A sine that starts downwards (report figure 52).
template <class P>
ExcitationSetup<P> inverted_sine(const ExcitationSetup<P>& setup) {
  return with_lines<P>(setup, {{1, 2 * kQuarterTurn, P(1.0)}});
}
// cos(t) + 0.5 sin(2 t) + sin(3 t) over its largest magnitude (report equation 60, which gives these three amplitudes
// and no others; t is 2 pi times the frequency times the time).
template <class P>
ExcitationSetup<P> composite(const ExcitationSetup<P>& setup) {
  return with_lines<P>(setup, {{1, kQuarterTurn, P(1.0)}, {2, 0, P(0.5)}, {3, 0, P(1.0)}});
}

// Lines of equal weight with phases drawn from a seed: `count` of them from `first` on. With `odd` only odd harmonics
// are taken, and of every `omit_one_of` (zero: none) one, drawn as well, is left out: a response at an omitted or an
// even line is distortion.
struct MultiSine {
  std::uint64_t seed = 1;
  std::uint16_t first = 1;
  std::uint16_t last = 31;
  bool odd = false;
  std::uint16_t omit_one_of = 0;
};
// Steele, Lea and Flood's SplitMix64: the same numbers everywhere, from any seed.
class SplitMix {
 public:
  constexpr explicit SplitMix(std::uint64_t seed) : state_(seed) {}
  constexpr std::uint64_t next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }
  constexpr std::uint64_t state() const { return state_; }  // the seed of what follows

 private:
  std::uint64_t state_;
};
// Host only.
template <class P>
ExcitationSetup<P> multi_sine(ExcitationSetup<P> setup, const MultiSine& signal) {
  setup.shape = Shape::lines;
  setup.line_count = 0;
  SplitMix random(signal.seed);
  std::uint32_t in_group = 0, omitted = 0;
  for (std::uint32_t harmonic = signal.first; harmonic <= signal.last; ++harmonic) {
    if (signal.odd && harmonic % 2 == 0) continue;
    if (signal.omit_one_of != 0) {
      if (in_group == 0) omitted = static_cast<std::uint32_t>((random.next() >> 32) % signal.omit_one_of);
      const bool leave_out = in_group == omitted;
      in_group = (in_group + 1) % signal.omit_one_of;
      if (leave_out) continue;
    }
    const auto phase = static_cast<std::uint32_t>(random.next() >> 32);
    require(setup.line_count < kMostLines, "a multi-sine has more lines than an excitation can hold");
    if (setup.line_count == kMostLines) break;
    setup.lines[setup.line_count++] = {static_cast<std::uint16_t>(harmonic), phase, P(1.0)};
  }
  return setup;
}

namespace detail {
// Sum of the lines at a phase of the cycle in 2^-32 turns; sines within 4e-9.
template <class P>
P sum_of_lines(const ExcitationSetup<P>& setup, std::uint32_t phase) {
  P sum(0.0);
  for (std::size_t i = 0; i < setup.line_count; ++i) {
    const Line<P>& line = setup.lines[i];
    sum = sum + line.weight * P(fixed::sine_cosine(line.harmonic * phase + line.phase).sine) * P(0x1p-30);
  }
  return sum;
}
template <class P>
P size_of_lines(const ExcitationSetup<P>& setup, std::uint32_t phase) {
  const P sum = sum_of_lines(setup, phase);
  return sum < P(0.0) ? -sum : sum;
}
inline std::uint32_t highest_harmonic(const auto& setup) {
  std::uint32_t highest = 1;
  for (std::size_t i = 0; i < setup.line_count; ++i)
    if (setup.lines[i].harmonic > highest) highest = setup.lines[i].harmonic;
  return highest;
}
// Largest magnitude of the sum. Between 64 samples to a cycle of the highest line a sum of sines exceeds the largest
// sample by no more than one over cos(pi/64) (Ehlich and Zeller, 1964), so the true peak is next to one of the samples
// that are this close to the largest.
template <class P>
P peak_of_lines(const ExcitationSetup<P>& setup) {
  constexpr double kNear = 0.9987;  // below cos(pi/64)
  constexpr int kThirds = 40;
  if (setup.line_count == 1) return setup.lines[0].weight < P(0.0) ? -setup.lines[0].weight : setup.lines[0].weight;
  const std::uint32_t samples = 64 * highest_harmonic(setup);
  const auto apart = static_cast<std::uint32_t>((std::uint64_t{1} << 32) / samples) + 1;
  P peak(0.0);
  for (std::uint32_t k = 0; k <= samples; ++k) {
    const P size = size_of_lines(setup, k * apart);
    if (size > peak) peak = size;
  }
  const P near = P(kNear) * peak;
  for (std::uint32_t k = 0; k <= samples; ++k) {
    if (size_of_lines(setup, k * apart) < near) continue;
    std::uint32_t low = k * apart - apart, width = 2 * apart;
    for (int i = 0; i < kThirds && width > 2; ++i) {
      const std::uint32_t third = width / 3;
      if (size_of_lines(setup, low + third) < size_of_lines(setup, low + width - third)) low += third;
      width -= third;
    }
    const P size = size_of_lines(setup, low + width / 2);
    if (size > peak) peak = size;
  }
  return peak;
}
}  // namespace detail

}  // namespace flexspline::control
