// Numbers from sums of samples: quotients, the impedance at the frequency of an injected voltage, the gains of the
// current sensors against each other.
#pragma once

#include <bit>
#include <cstdint>

#include "shared/control/commissioning/settings.hpp"
#include "shared/control/foc/transforms.hpp"
#include "shared/fixed/bits.hpp"
#include "shared/fixed/derived_fields.hpp"

namespace flexspline::control::commissioning {

// a/b in 2^-bits, within 2^-29 of itself, held at a word. b of zero counts as one.
constexpr std::int32_t ratio(std::int64_t a, std::int64_t b, int bits) {
  const std::uint64_t size = fixed::size_of(a), by = b == 0 ? 1 : fixed::size_of(b);
  if (size == 0) return 0;
  const int up = std::countl_zero(size), down = by >> 31 == 0 ? 0 : 33 - std::countl_zero(by);
  // By the library: bit by bit, what ends a step would take longer than a PWM period.
  const std::uint64_t quotient = (size << up) / (by >> down);
  const int shift = up + down - bits;
  constexpr std::uint64_t kMost = INT32_MAX;
  std::uint64_t x = kMost;
  if (shift >= 64)
    x = 0;
  else if (shift >= 0)
    x = quotient >> shift;
  else if (-shift < std::countl_zero(quotient))
    x = quotient << -shift;
  return static_cast<std::int32_t>(fixed::with_sign(x < kMost ? x : kMost, (a < 0) != (b < 0)));
}

// Of samples of a vector.
struct VectorSum {
  std::int64_t d = 0;
  std::int64_t q = 0;
  constexpr void add(const foc::RotorVector& x) {
    d += x.d;
    q += x.q;
  }
};

// A voltage A cos(2 pi k/8) and what else the loop adds, correlated with the current along the same axis. A voltage
// that stands for a period whose middle is the sample meets
//   Z = R (1 + j t coth u)/(1 + j t tanh(u/2)),   t = tan(pi/8), u = R T/(2 L)
// from which, up to u^3, L/T = Im Z/(2 t) + R^2 T/(19.1 L).
class Impedance {
 public:
  static constexpr std::uint32_t kTurnsPerPeriod = 1U << 29;  // one eighth
  static constexpr int kSamplesBits = 12;

  constexpr std::uint32_t phase() const { return static_cast<std::uint32_t>(count_) * kTurnsPerPeriod; }
  constexpr bool done() const { return count_ == (1 << kSamplesBits); }
  constexpr std::int32_t count() const { return count_; }
  // The voltage that acts in the period of the current's sample.
  constexpr void add(std::int32_t voltage, std::int32_t current) {
    const foc::Rotation r = foc::rotation(phase());
    voltage_.d += fixed::multiply_high(voltage, r.cosine);
    voltage_.q += fixed::multiply_high(voltage, r.sine);
    current_.d += fixed::multiply_high(current, r.cosine);
    current_.q += fixed::multiply_high(current, r.sine);
    ++count_;
  }
  constexpr std::int32_t inductance(std::int32_t resistance) const {
    // Means of at most 2^28 and 2^27: products below 2^57.
    const auto mean = [](std::int64_t x) { return x >> kSamplesBits; };
    const std::int64_t vc = mean(voltage_.d), vs = mean(voltage_.q), ic = mean(current_.d), is = mean(current_.q);
    constexpr int kUnits = kSharesBits - 1;  // voltages in 2^-28, currents in 2^-27
    const std::int64_t imaginary = ratio(vc * is - vs * ic, ic * ic + is * is, kUnits - 4);
    constexpr std::int64_t kPerTwiceTangent = 5062972;  // 2^-22
    const std::int64_t first = (imaginary * kPerTwiceTangent) >> (22 - 4);
    if (first <= 0) return 0;
    const std::int64_t more = ratio(std::int64_t{resistance} * resistance, first, 0) / 19;
    return static_cast<std::int32_t>(fixed::limited<std::int64_t>(first + more, 0, INT32_MAX));
  }

 private:
  VectorSum voltage_, current_;
  std::int32_t count_ = 0;
};

// Currents add up to zero, so readings r of sensors with gains g meet r_a/g_a + r_b/g_b + r_c/g_c = 0. Three of them in
// the directions of the phases, which turn on: 1/g is along the sum of their cross products.
struct PhaseMeans {
  std::int64_t a = 0;
  std::int64_t b = 0;
  std::int64_t c = 0;
};
constexpr PhaseMeans cross(const PhaseMeans& x, const PhaseMeans& y) {
  return {x.b * y.c - x.c * y.b, x.c * y.a - x.a * y.c, x.a * y.b - x.b * y.a};
}
// Corrections to gains, 4096 for one. Their mean is one: what all sensors have in common does not show. Sums below
// 2^29.
constexpr foc::Phases gain_corrections(const PhaseMeans& first, const PhaseMeans& second, const PhaseMeans& third) {
  const PhaseMeans one = cross(first, second), two = cross(second, third), three = cross(third, first);
  const PhaseMeans all = {one.a + two.a + three.a, one.b + two.b + three.b, one.c + two.c + three.c};
  const std::int64_t sum = all.a + all.b + all.c;
  return {ratio(3 * all.a, sum, 12), ratio(3 * all.b, sum, 12), ratio(3 * all.c, sum, 12)};
}

// The angle of a vector, 2^-32 turns, by CORDIC: within 3e-7 turns. Components below 2^29.
constexpr std::uint32_t angle_of(std::int32_t y, std::int32_t x) {
  constexpr std::uint32_t kSteps[] = {536870912, 316933406, 167458907, 85004756, 42667331, 21354465, 10679838,
                                      5340245,   2670163,   1335087,   667544,   333772,   166886,   83443,
                                      41722,     20861,     10430,     5215,     2608,     1304};
  std::uint32_t angle = 0;
  if (x < 0) {
    x = -x;
    y = -y;
    angle = 0x80000000U;
  }
  for (int k = 0; k < 20; ++k) {
    const std::int32_t before = x;
    if (y > 0) {
      x += y >> k;
      y -= before >> k;
      angle += kSteps[k];
    } else {
      x += -y >> k;
      y += before >> k;
      angle -= kSteps[k];
    }
  }
  return angle;
}

// Inductances by injections along 0, 1/8 and 1/4 of a turn from an axis. Along an angle x from it
//   1/L = Y + Z cos(2 (x - e)),   Y = (1/Ld + 1/Lq)/2,  Z = (1/Ld - 1/Lq)/2,  e: angle of the true d
// `expected`: where the encoder has d. A magnet's axis that was found with a large current is off where reluctance
// turns the rotor away from it: there Lq is the larger one, Z above zero, and e is taken from the three inductances;
// else from the encoder, as that is better.
struct Inductances {
  std::int32_t d = 0;
  std::int32_t q = 0;
  std::int32_t off = 0;  // e less what was expected, 2^-32 turns
};
constexpr Inductances inductances_of(std::int32_t at_0, std::int32_t at_eighth, std::int32_t at_quarter,
                                     std::int32_t expected) {
  constexpr std::int64_t kOne = std::int64_t{1} << 50;
  constexpr std::int32_t kDegree = 11930465, kMost = 1 << 28;
  const std::int32_t y0 = ratio(kOne, at_0, 0), y45 = ratio(kOne, at_eighth, 0), y90 = ratio(kOne, at_quarter, 0);
  if (y0 >= kMost || y45 >= kMost || y90 >= kMost) return {};
  const std::int32_t middle = y0 / 2 + y90 / 2, cosine = y0 / 2 - y90 / 2, sine = y45 - middle;
  const auto along = [&](std::int32_t e) {
    const foc::Rotation r = foc::rotation(static_cast<std::uint32_t>(e) * 2);
    return 4 * (fixed::multiply_high(cosine, r.cosine) + fixed::multiply_high(sine, r.sine));
  };
  const auto apart = [&](std::int32_t e) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(e) - static_cast<std::uint32_t>(expected));
  };
  const auto within = [](std::int32_t x, std::int32_t degrees) {
    return x < degrees * kDegree && x > -degrees * kDegree;
  };
  // The axis of the smaller inductance, and of the larger one.
  const std::int32_t small = static_cast<std::int32_t>(angle_of(sine, cosine)) / 2;
  const std::int32_t large = static_cast<std::int32_t>(angle_of(-sine, -cosine)) / 2;
  const bool stays = along(small) < middle / 10 || within(apart(small), 4) || within(apart(large), 9);
  const std::int32_t difference = along(stays ? expected : small);
  return {ratio(kOne, std::int64_t{middle} + difference, 0), ratio(kOne, std::int64_t{middle} - difference, 0),
          stays ? 0 : apart(small)};
}

// x a 2^-bits in 64 bits, for the product of a share and a signal.
constexpr std::int32_t scaled(std::int32_t x, std::int32_t a, int bits) {
  return static_cast<std::int32_t>(fixed::limited<std::int64_t>((std::int64_t{x} * a) >> bits, -INT32_MAX, INT32_MAX));
}

// The flux of a current, for a turn instead of a radian; and the voltage that it induces at a speed in 2^-32 turns a
// period, 2^-28. Units of the rest as `Result` has them.
constexpr std::int32_t linkage(std::int32_t inductance, std::int32_t current) {
  constexpr std::int32_t kTwoPi = 1686629713;  // 2^-28
  return scaled(scaled(inductance, current, 27), kTwoPi, 28);
}
constexpr std::int32_t induced_voltage(std::int32_t inductance, std::int32_t current, std::int32_t speed) {
  return scaled(linkage(inductance, current), speed, 32 - 28 + kSharesBits);
}

}  // namespace flexspline::control::commissioning
