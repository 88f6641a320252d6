// Elementary functions in integers against long double, over their whole domain: ends, powers of two and their
// neighbours, and points drawn at random.
#include "shared/fixed/elementary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>

#include "shared/fixed/system.hpp"

namespace flexspline::tests::fixed_elementary_test {
namespace {

using fixed::Fixed;

constexpr int kDraws = 100'000;
const long double kUnit = ldexpl(1.0L, -fixed::kValueBits);

// Calls `look` for whole numbers from low to high: the ends, next to each power of two, and at random over the range
// and over its logarithm.
void over(std::uint64_t low, std::uint64_t high, const std::function<void(std::uint64_t)>& look) {
  std::mt19937_64 random(11);
  look(low);
  look(high);
  for (int bit = 0; bit < 64; ++bit)
    for (const std::uint64_t x :
         {(std::uint64_t{1} << bit) - 1, std::uint64_t{1} << bit, (std::uint64_t{1} << bit) + 1})
      if (x >= low && x <= high) look(x);
  for (int k = 0; k < kDraws; ++k) {
    const std::uint64_t span = high - low;
    look(low + (span == ~std::uint64_t{0} ? random() : random() % (span + 1)));
    const std::uint64_t small = random() >> (random() % 64);
    if (small >= low && small <= high) look(small);
  }
}
long double real(std::uint64_t x, int bits) {
  return ldexpl(static_cast<long double>(x), -bits);
}

TEST(FixedBits, ProductsOf64BitsAreExact) {
  std::mt19937_64 random(3);
  for (int k = 0; k < kDraws; ++k) {
    const std::uint64_t a = random() >> (random() % 64);
    const std::uint64_t b = random() >> (random() % 64);
    __extension__ using Wide = unsigned __int128;
    const Wide exact = static_cast<Wide>(a) * b;
    // As a processor of 32 bits does it, and as this one.
    for (const fixed::Product p : {fixed::multiply_by_words(a, b), fixed::multiply(a, b)}) {
      ASSERT_EQ(p.low, static_cast<std::uint64_t>(exact));
      ASSERT_EQ(p.high, static_cast<std::uint64_t>(exact >> 64));
    }
  }
}

TEST(FixedBits, ShiftsRoundToTheNearest) {
  for (const int bits : {1, 3, 27, 40, 62}) {
    std::mt19937_64 random(5);
    for (int k = 0; k < 1000; ++k) {
      const auto x = static_cast<std::int64_t>(random());
      const long double exact = ldexpl(static_cast<long double>(x), -bits);
      ASSERT_LE(fabsl(static_cast<long double>(fixed::shift_right(x, bits)) - exact), 0.5L);
    }
  }
  EXPECT_EQ(fixed::shift_right(5, -3), 40);
  EXPECT_EQ(fixed::shift_right(-5, -3), -40);
  EXPECT_EQ(fixed::shift_right(INT64_MIN, 64), 0);
  EXPECT_EQ(fixed::multiply_round(-3, std::int64_t{1} << 40, 41), -2);  // halves away from zero
}

TEST(FixedElementary, DecayIsWithinItsErrorAndKeepsWhatTheSmallestTravelLoses) {
  long double worst = 0.0L, worst_lost = 0.0L;
  over(0, fixed::kLargestTravel, [&](std::uint64_t x) {
    const long double travel = real(x, fixed::kTravelBits);
    const std::uint64_t given = fixed::decay(x);
    worst = std::max(worst, fabsl(real(given, 60) - expl(-travel)));
    if (travel < 0.69L && x > 1000) {
      const long double lost = -expm1l(-travel);
      worst_lost = std::max(worst_lost, fabsl(real((std::uint64_t{1} << 60) - given, 60) - lost) / lost);
    }
  });
  EXPECT_LT(worst, 1e-9L);
  EXPECT_LT(worst_lost, 2e-9L + 1e-3L);  // a thousand units of travel: their rounding
  EXPECT_EQ(fixed::decay(0), std::uint64_t{1} << 60);
  long double worst_wide = 0.0L;
  over(std::uint64_t{1} << 30, fixed::kLn2, [&](std::uint64_t x) {
    const long double lost = -expm1l(-real(x, fixed::kTravelBits));
    worst_wide = std::max(worst_wide, fabsl(real((std::uint64_t{1} << 60) - fixed::decay(x), 60) - lost) / lost);
  });
  EXPECT_LT(worst_wide, 2e-9L);
}

TEST(FixedElementary, PowersOfTwoAndTheirLogarithmsAreWithinTheirErrors) {
  long double worst = 0.0L;
  over(0, 0x7FFFFFFF, [&](std::uint64_t x) {
    worst = std::max(worst, fabsl(real(fixed::power_of_two(static_cast<std::int32_t>(x)), 30) - exp2l(real(x, 31))));
  });
  EXPECT_LT(worst, 3.2L * ldexpl(1.0L, -30));  // 3.12 where it is worst, which few places are
  long double worst_log = 0.0L;
  over(1, ~std::uint64_t{0}, [&](std::uint64_t x) {
    const auto given = ldexpl(static_cast<long double>(fixed::log2_of(x)), -fixed::kLogBits);
    worst_log = std::max(worst_log, fabsl(given - log2l(static_cast<long double>(x))));
  });
  EXPECT_LT(worst_log, 8e-11L);
}

TEST(FixedElementary, ReciprocalsAreWithinTheirError) {
  long double worst = 0.0L;
  over(1, ~std::uint64_t{0}, [&](std::uint64_t x) {
    const fixed::Reciprocal r = fixed::reciprocal_of(x);
    worst = std::max(worst, fabsl(ldexpl(real(r.mantissa, 30), r.exponent) * static_cast<long double>(x) - 1.0L));
  });
  EXPECT_LT(worst, 2.5e-9L);
}

TEST(FixedElementary, SineAndCosineAreWithinTheirErrorAndOnTheUnitCircle) {
  long double worst = 0.0L;
  over(0, 0xFFFFFFFF, [&](std::uint64_t x) {
    const long double phase = 2.0L * std::numbers::pi_v<long double> * real(x, 32);
    const fixed::SineCosine w = fixed::sine_cosine(static_cast<std::uint32_t>(x));
    worst = std::max({worst, fabsl(ldexpl(w.sine, -30) - sinl(phase)), fabsl(ldexpl(w.cosine, -30) - cosl(phase))});
  });
  EXPECT_LT(worst, 4.0L * ldexpl(1.0L, -30));
}

TEST(FixedFunctions, OfTheSystemAreWithinAUnitOfAValue) {
  long double lorentzian = 0.0L, mean = 0.0L, wave = 0.0L;
  over(0, std::uint64_t{1} << 61, [&](std::uint64_t raw) {
    for (const int sign : {-1, 1}) {
      const auto x = static_cast<std::int64_t>(raw) * sign;
      const long double r = ldexpl(static_cast<long double>(x), -fixed::kRatioBits);
      lorentzian = std::max(
          lorentzian, fabsl(real(static_cast<std::uint64_t>(Fixed::lorentzian({x}).raw), 27) - 1.0L / (1.0L + r * r)));
    }
  });
  EXPECT_LT(lorentzian, 1.3L * kUnit);  // far out it is taken as one unit
  over(0, fixed::kLargestTravel, [&](std::uint64_t x) {
    const long double t = real(x, fixed::kTravelBits);
    const long double exact = x == 0 ? 1.0L : -expm1l(-t) / t;
    mean = std::max(mean, fabsl(real(static_cast<std::uint64_t>(Fixed::exp_mean({x}).raw), 27) - exact));
  });
  EXPECT_LT(mean, 1.5L * kUnit);
  over(0, 0xFFFFFFFF, [&](std::uint64_t x) {
    const long double phase = 2.0L * std::numbers::pi_v<long double> * real(x, 32);
    const auto w = Fixed::sincos({static_cast<std::int64_t>(x) + (std::int64_t{77} << 32)});
    wave =
        std::max({wave, fabsl(ldexpl(w.sine.raw, -27) - sinl(phase)), fabsl(ldexpl(w.cosine.raw, -27) - cosl(phase))});
  });
  EXPECT_LT(wave, 0.9L * kUnit);
}

TEST(FixedFunctions, ExponentialAndReciprocalOfAValueAreWithinTheirErrors) {
  long double exponential = 0.0L, reciprocal = 0.0L;
  over(0, 0x7FFFFFFF, [&](std::uint64_t raw) {
    for (const std::int32_t x : {static_cast<std::int32_t>(raw), -static_cast<std::int32_t>(raw)}) {
      const long double value = ldexpl(x, -27);
      const long double exact = expl(-std::max(value, -2.75L));
      const auto given = ldexpl(Fixed::exp_negative(Fixed::Value{{x}}).raw, -27);
      exponential = std::max(exponential, fabsl(given - exact) / (0.5L * kUnit + 4e-9L * exact));
    }
    const auto x = static_cast<std::int32_t>(raw);
    const long double exact = 1.0L / std::max(ldexpl(x, -27), 1.0L / 15.0L);
    const auto given = ldexpl(Fixed::reciprocal(Fixed::Value{{x}}).raw, -27);
    reciprocal = std::max(
        reciprocal, fabsl(given - exact) / (0.5L * kUnit + 4e-9L * exact + 15.0L * 15.0L * kUnit * (exact > 14.99L)));
  });
  EXPECT_LT(exponential, 1.0L);
  EXPECT_LT(reciprocal, 1.0L);
}

// Powers of what is up to two, for all exponents that effects have.
TEST(FixedFunctions, PowersAreWithinTheirError) {
  for (const double e : {0.0, 0.1, 0.15, 0.5, 0.85, 1.0, 1.7, 2.0, 3.0, 4.0}) {
    const fixed::Exponent exponent = Fixed::exponent(e);
    const long double exact_e = ldexpl(exponent.raw, -fixed::kExponentBits);
    long double worst = 0.0L;
    over(0, std::uint64_t{1} << 61, [&](std::uint64_t raw) {
      const long double exact = powl(real(raw, fixed::kStateBits), exact_e);
      if (exact > 11.0L) return;  // a power ends there
      const auto given = ldexpl(Fixed::pow_abs(Fixed::State{{-static_cast<std::int64_t>(raw)}}, exponent).raw, -27);
      worst = std::max(worst, fabsl(given - exact) / (1.1L * kUnit + (5e-9L + 7e-8L * fabsl(exact_e)) * exact));
    });
    EXPECT_LT(worst, 1.0L) << e;
  }
}

// Signals from the smallest to the largest over characteristic sizes of four orders.
TEST(FixedFunctions, BellsAndPowersOfRatiosAreWithinTheirErrors) {
  long double bell = 0.0L, power = 0.0L;
  for (const double size : {0.03, 0.7, 1.0, 2.0, 3.99, 20.0, 77.7, 5e3}) {
    const fixed::RatioGain gain = Fixed::ratio_gain(size);
    const fixed::Exponent e = Fixed::exponent(0.45);
    over(1, 0x7FFFFFFF, [&](std::uint64_t raw) {
      const Fixed::Value x{{static_cast<std::int32_t>(raw % 2 == 0 ? raw : 0 - raw)}};
      const long double r = ldexpl(x.raw, -27) * static_cast<long double>(size);
      bell = std::max(bell, fabsl(ldexpl(Fixed::gauss(Fixed::ratio(gain, x)).raw, -27) - expl(-r * r)));
      const long double exact = powl(fabsl(r), ldexpl(e.raw, -28));
      if (exact > 11.0L) return;
      power = std::max(power, fabsl(ldexpl(Fixed::pow_abs(Fixed::ratio(gain, x), e).raw, -27) - exact) /
                                  (1.0L * kUnit + 3e-8L * exact));
    });
    EXPECT_EQ(Fixed::pow_abs(Fixed::ratio(gain, {}), e).raw, 0);
    EXPECT_NEAR(ldexpl(Fixed::gauss(Fixed::ratio(gain, {})).raw, -27), 1.0L, kUnit);
  }
  EXPECT_LT(bell, 2.0L * kUnit);
  EXPECT_LT(power, 1.0L);
}

TEST(FixedElementary, SinesOfAWordAreWithinTheirError) {
  long double worst = 0.0L;
  over(0, 0xFFFFFFFF, [&](std::uint64_t x) {
    const long double exact = sinl(2.0L * std::numbers::pi_v<long double> * real(x, 32));
    worst = std::max(worst, fabsl(ldexpl(fixed::sine_word(static_cast<std::uint32_t>(x)), -27) - exact));
  });
  EXPECT_LT(worst, 2.0L * kUnit);
}

TEST(FixedElementary, WhatARelaxationLosesIsWithinItsErrorHoweverLittle) {
  long double worst = 0.0L, worst_of_itself = 0.0L;
  over(0, fixed::kLargestTravel, [&](std::uint64_t x) {
    worst = std::max(worst, fabsl(real(fixed::one_minus_exp(x), 63) + expm1l(-real(x, fixed::kTravelBits))));
  });
  over(std::uint64_t{1} << 27, fixed::kLn2 / 2, [&](std::uint64_t x) {
    const long double lost = -expm1l(-real(x, fixed::kTravelBits));
    worst_of_itself = std::max(worst_of_itself, fabsl(real(fixed::one_minus_exp(x), 63) - lost) / lost);
  });
  EXPECT_LT(worst, 8e-9L);
  EXPECT_LT(worst_of_itself, 2e-8L);
  EXPECT_EQ(fixed::one_minus_exp(0), 0U);
}

TEST(FixedSystem, AHarmonicIsItsTwoAmplitudesOverAMillionTurns) {
  const double order = 3.07, cosine = 0.3, sine = -0.2;
  const auto h = Fixed::harmonic(order * 2.0 * std::numbers::pi, cosine, sine);
  for (const std::int64_t turns : {0, 1, -1, 1'000'000, -1'000'000}) {
    for (const std::uint32_t part : {0U, 0x12345678U, 0x80000000U, 0xFFFFFFFFU}) {
      const fixed::Angle angle{turns * (std::int64_t{1} << 32) + part};
      const long double q = (static_cast<long double>(turns) + ldexpl(part, -32)) * static_cast<long double>(order);
      const long double phase = 2.0L * std::numbers::pi_v<long double> * (q - floorl(q));
      const long double exact = cosine * cosl(phase) + sine * sinl(phase);
      EXPECT_NEAR(std::ldexp(static_cast<double>(Fixed::wave(h, angle).raw), -fixed::kSumBits),
                  static_cast<double>(exact), 4e-8)
          << turns << " " << part;
    }
  }
}

TEST(FixedFunctions, TheQExponentialIsWithinItsErrorAndHasNoGapAtOne) {
  for (const double q : {0.5, 0.7, 0.95, 0.999, 0.99999, 1.0, 1.00001, 1.001, 1.04, 1.5, 2.0, 3.0, 4.0}) {
    const fixed::Exponent exponent = Fixed::exponent(q);
    const long double less_one = ldexpl(exponent.raw, -fixed::kExponentBits) - 1.0L;
    long double worst = 0.0L, worst_lost = 0.0L;
    over(0, fixed::kLargestTravel, [&](std::uint64_t raw) {
      const long double x = real(raw, fixed::kTravelBits);
      const long double z = less_one * x;
      const long double exact = z <= -1.0L ? 0.0L : less_one == 0.0L ? expl(-x) : expl(-log1pl(z) / less_one);
      const long double given = 1.0L - real(Fixed::q_exp_negative({raw}, exponent).lost, 63);
      worst = std::max(worst, fabsl(given - exact));
      if (raw > (std::uint64_t{1} << 30) && x < 0.1L)
        worst_lost = std::max(worst_lost, fabsl((1.0L - given) - (1.0L - exact)) / x);
    });
    EXPECT_LT(worst, 6e-9L) << q;
    EXPECT_LT(worst_lost, 1.2e-8L) << q;  // of a small travel as exact as of a large one
  }
}

}  // namespace
}  // namespace flexspline::tests::fixed_elementary_test
