// The number systems of the drive: kinds of numbers keep apart, coefficients clamp their input, what is safe by proof
// is looked at by the checked one, and intervals hold all that the drive can give.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <type_traits>

#include "shared/fixed/checked.hpp"
#include "shared/fixed/intervals.hpp"
#include "shared/fixed/system.hpp"

namespace flexspline::tests::fixed_system_test {
namespace {

using fixed::Checked;
using fixed::Fixed;
using fixed::Intervals;
using fixed::OverflowLog;

const double kUnit = std::ldexp(1.0, -fixed::kValueBits);

double real(Fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
double real(fixed::Sum x) {
  return std::ldexp(static_cast<double>(x.raw), -fixed::kSumBits);
}
double real(Fixed::State x) {
  return std::ldexp(static_cast<double>(x.raw), -fixed::kStateBits);
}

// Kinds of numbers become one another only through a named function, and never from a double by themselves.
static_assert(!std::is_convertible_v<double, Fixed::Value> && !std::is_convertible_v<int, Fixed::Value>);
static_assert(!std::is_convertible_v<Fixed::Step, Fixed::Value>);
static_assert(!std::is_convertible_v<Fixed::State, Fixed::Value>);
static_assert(!std::is_convertible_v<Fixed::Value, Fixed::Sum>);
static_assert(!std::is_convertible_v<Fixed::Angle, Fixed::Step>);
static_assert(!std::is_convertible_v<Fixed::Gain, Fixed::RatioGain>);
static_assert(!std::is_convertible_v<Fixed::Travel, Fixed::State>);
static_assert(!std::is_convertible_v<Fixed::Share, Fixed::State>);

TEST(FixedSystem, GainClampsItsInputSoThatNoSizeOfGainOverflows) {
  for (const double size : {0.0, 1e-9, 3e-4, 0.3, 1.0, 7.0, 900.0, 1e6}) {
    for (const double sign : {-1.0, 1.0}) {
      const Fixed::Gain gain = Fixed::gain(sign * size);
      for (const double x : {-15.99, -1.0, -1e-4, 0.0, 2e-6, 0.7, 15.99}) {
        const double limit = fixed::kLargestValue / size;
        const double input = real(Fixed::value(x));
        const double expected = sign * size * std::clamp(input, -limit, limit);
        // Half a unit of the mantissa; what the limit loses by rounding down; half a unit of the result.
        const double bound = 16.0 * std::ldexp(1.0, -30) + size * kUnit;
        EXPECT_NEAR(real(gain * Fixed::value(x)), expected, bound + std::ldexp(1.0, -50));
        EXPECT_NEAR(real(Fixed::scaled(gain, Fixed::value(x))), expected, bound + kUnit / 2);
      }
    }
  }
}

TEST(FixedSystem, WhatDoesNotFitAFormatIsFoundWhenItIsMade) {
  OverflowLog::clear();
  Fixed::value(15.9);
  Fixed::gain(1e6);
  Fixed::exponent(-7.9);
  Fixed::order(1000.0);
  EXPECT_EQ(OverflowLog::count(), 0);
  const auto is_found = [](auto&& make) {
    OverflowLog::clear();
    make();
    return OverflowLog::count() == 1;
  };
  EXPECT_TRUE(is_found([] { Fixed::value(16.0); }));
  EXPECT_TRUE(is_found([] { Fixed::value(std::nan("")); }));
  EXPECT_TRUE(is_found([] { Fixed::gain(1e12); }));
  EXPECT_TRUE(is_found([] { Fixed::gain(HUGE_VAL); }));
  EXPECT_TRUE(is_found([] { Fixed::exponent(8.0); }));
  EXPECT_TRUE(is_found([] { Fixed::share(1.0 + 1e-9); }));
  EXPECT_TRUE(is_found([] { Fixed::share(-1e-9); }));
  EXPECT_TRUE(is_found([] { Fixed::share(std::nan("")); }));
  EXPECT_TRUE(is_found([] { Fixed::order(1e6); }));
}

TEST(FixedSystem, AWeightTimesAValueIsExactUpToTheRoundingOfTheWeight) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 10'000; ++k) {
    const double size = std::ldexp(static_cast<double>(static_cast<std::int64_t>(random()) >> 11), -49);  // below 16
    const Fixed::Value x{{static_cast<std::int32_t>(random())}};
    ASSERT_NEAR(real(Fixed::weight(size) * x), size * real(x), kUnit / 2 * std::abs(real(x)) + 1e-15);
  }
}

// One relaxation may pass its target by a unit, but none leads further, however often it is repeated.
TEST(FixedSystem, RelaxingStaysWithinAUnitOfWhatLiesBetweenStateAndTarget) {
  constexpr std::int64_t kPast = std::int64_t{1} << (fixed::kStateBits - 27);
  std::mt19937_64 random(1);
  for (int k = 0; k < 100'000; ++k) {
    const Fixed::State from{{static_cast<std::int64_t>(random()) >> 3}};
    const Fixed::State target{{static_cast<std::int64_t>(random()) >> (3 + random() % 60)}};
    const Fixed::State share{
        {static_cast<std::int64_t>(random() % ((std::uint64_t{1} << fixed::kStateBits) + 1)) >> (random() % 50)}};
    const Fixed::State to = Fixed::relax(from, target, share);
    ASSERT_GE(to.raw, std::min(from.raw, target.raw - kPast));
    ASSERT_LE(to.raw, std::max(from.raw, target.raw + kPast));
    const long double kept = (static_cast<long double>(from.raw) - static_cast<long double>(target.raw)) *
                             ldexpl(static_cast<long double>(share.raw), -fixed::kStateBits);
    // The distance counts to 2^-28, the share to 2^-30.
    const long double bound =
        ldexpl(1.0L, fixed::kStateBits - 28) +
        ldexpl(fabsl(static_cast<long double>(from.raw) - static_cast<long double>(target.raw)), -29);
    ASSERT_LE(fabsl(static_cast<long double>(to.raw) - static_cast<long double>(target.raw) - kept), bound);
  }
  const Fixed::State all{{std::int64_t{1} << fixed::kStateBits}};
  EXPECT_EQ(Fixed::relax(Fixed::State{{12345}}, Fixed::State{{-77}}, all).raw, 12345);
}

TEST(FixedSystem, AShareOfAStateIsExactToItsLastBits) {
  std::mt19937_64 random(2);
  for (int k = 0; k < 100'000; ++k) {
    const Fixed::State x{{static_cast<std::int64_t>(random()) >> (random() % 63)}};
    const double size = std::ldexp(static_cast<double>(random() >> 11), -53 - static_cast<int>(random() % 30));
    const fixed::Share share = Fixed::share(size);
    const long double exact = static_cast<long double>(x.raw) * ldexpl(static_cast<long double>(share.raw), -63);
    ASSERT_LE(fabsl(static_cast<long double>(Fixed::times(x, share).raw) - exact), 6.0L + fabsl(exact) * 0x1p-61L);
    ASSERT_LE(fabsl(ldexpl(static_cast<long double>(share.raw), -63) - static_cast<long double>(size)), 0x1p-63L);
  }
  const std::int64_t whole = std::int64_t{1} << fixed::kStateBits;
  EXPECT_NEAR(static_cast<double>(Fixed::times(Fixed::State{{whole}}, Fixed::share(1.0)).raw - whole), 0.0, 4.0);
  EXPECT_EQ(Fixed::times(Fixed::State{{INT64_MIN}}, Fixed::share(0.0)).raw, 0);
}

TEST(FixedSystem, AStepAsASignalIsExactAndEndsAtTwo) {
  for (const double size : {0.0, 1e-3, 0.7, 3.9, 4.1, 500.0, 1e5, 3e6}) {
    for (const double sign : {-1.0, 1.0}) {
      const auto gain = Fixed::step_gain(sign * size);
      for (const std::int64_t raw : {std::int64_t{0}, std::int64_t{1}, std::int64_t{-17}, std::int64_t{123'456},
                                     std::int64_t{1} << 30, -(std::int64_t{1} << 30), INT64_MAX, INT64_MIN}) {
        // A gain below four reaches half a turn first.
        const double turns = std::clamp(std::ldexp(static_cast<double>(raw), -32), -0.5, 0.5);
        const double expected = std::clamp(sign * size * turns, -2.0, 2.0);
        // Factors are words; a whole number of steps makes at most two.
        const double bound = (1e-9 + (size > 0.0 ? std::ldexp(1.0, -26) / size : 0.0)) * std::abs(expected) +
                             (std::abs(expected) == 2.0 ? std::ldexp(size, -32) : 0.0);
        EXPECT_NEAR(real(Fixed::signal(gain, {raw})), expected, bound + std::ldexp(1.0, -fixed::kStateBits))
            << size << " " << raw;
      }
    }
  }
}

TEST(FixedSystem, AFractionalOrderKeepsItsPhaseOverAMillionTurns) {
  const double order = 3.07;
  const fixed::Order made = Fixed::order(order * 2.0 * 3.14159265358979323846);
  for (const std::int64_t turns : {0, 1, -1, 1'000'000, -1'000'000}) {
    const fixed::Angle angle{turns * (std::int64_t{1} << 32) + 0x40000000};
    const long double exact = (static_cast<long double>(turns) + 0.25L) * static_cast<long double>(order);
    const long double given = ldexpl(static_cast<long double>(Fixed::times_order(angle, made).raw), -32);
    EXPECT_NEAR(static_cast<double>(given - exact), 0.0, 1e-8) << turns;
  }
}

TEST(FixedSystem, TravelsSaturateInsteadOfWrapping) {
  const auto gain = Fixed::step_gain(1e5);
  EXPECT_NEAR(
      std::ldexp(static_cast<double>(fixed::Travel(Fixed::travel(gain, Fixed::magnitude(fixed::Step{INT64_MAX}))).raw),
                 -58),
      31.0, 1e-3);
  EXPECT_EQ(fixed::Travel(Fixed::travel(gain, Fixed::magnitude(fixed::Step{INT64_MIN}))).raw,
            fixed::Travel(Fixed::travel(gain, Fixed::magnitude(fixed::Step{INT64_MAX}))).raw);
  const fixed::Travel most{fixed::kLargestTravel};
  EXPECT_EQ(Fixed::times(most, Fixed::value(15.9)).raw, fixed::kLargestTravel);
  EXPECT_EQ(Fixed::over(most, Fixed::value(1e-6)).raw, fixed::kLargestTravel);
  EXPECT_EQ(Fixed::over(most, Fixed::value(0.0)).raw, fixed::kLargestTravel);
  EXPECT_EQ(Fixed::over({}, Fixed::value(0.0)).raw, 0u);
  EXPECT_EQ(Fixed::times_power(most, Fixed::State{{1}}, Fixed::exponent(-0.5)).raw, fixed::kLargestTravel);
  EXPECT_EQ(real(Fixed::step(most, Fixed::value(-15.9))), -4.0);
  EXPECT_NEAR(std::ldexp(static_cast<double>(Fixed::over({fixed::kLargestTravel / 31}, Fixed::value(0.25)).raw), -58),
              4.0, 1e-8);
  // 0.1 (1/4)^(-1/2)
  EXPECT_NEAR(
      std::ldexp(static_cast<double>(Fixed::times_power({fixed::kLargestTravel / 310},
                                                        Fixed::State{{std::int64_t{1} << (fixed::kStateBits - 2)}},
                                                        Fixed::exponent(-0.5))
                                         .raw),
                 -58),
      0.2, 1e-9);
}

TEST(CheckedSystem, FindsWhatLeavesItsRangeAndGivesTheSameBits) {
  const auto large = Checked::value(10.0);
  const Checked::State nine{{std::int64_t{9} << fixed::kStateBits}};
  const auto finds = [](auto&& compute) {
    OverflowLog::clear();
    compute();
    return OverflowLog::count();
  };
  EXPECT_EQ(finds([&] { static_cast<void>(Checked::value(5.0) + large); }), 0);
  EXPECT_EQ(finds([&] { static_cast<void>(large + large); }), 1);
  EXPECT_EQ(finds([&] { static_cast<void>(Checked::times(large, large)); }), 1);
  EXPECT_EQ(finds([&] { static_cast<void>(nine + nine); }), 1);
  EXPECT_EQ(finds([&] { static_cast<void>(nine - nine); }), 0);
  EXPECT_EQ(finds([&] { static_cast<void>(Checked::widen(large)); }), 0);
  EXPECT_EQ(finds([&] { static_cast<void>(Checked::times(nine, Checked::value(3.0))); }), 1);
  EXPECT_EQ(finds([&] { static_cast<void>(Checked::pow_abs(nine, Checked::exponent(2.0))); }), 1);
  EXPECT_EQ((large + large).raw, (Fixed::value(10.0) + Fixed::value(10.0)).raw);
  EXPECT_EQ((nine + nine).raw, (Fixed::State{{nine.raw}} + Fixed::State{{nine.raw}}).raw);
}

// Every function of the number systems with inputs drawn from a range: the result lies in the range that intervals
// give.
class IntervalsHold : public testing::Test {
 protected:
  using Range = Intervals::Value;
  std::mt19937_64 random_{9};

  std::int64_t draw(std::int64_t most) {
    const auto size = static_cast<std::int64_t>((random_() >> (random_() % 40)) % static_cast<std::uint64_t>(most));
    return random_() % 2 ? size : -size;
  }
  Range range(std::int64_t most) {
    const std::int64_t a = draw(most);
    const std::int64_t b = draw(most);
    return {std::min(a, b), std::max(a, b)};
  }
  std::int64_t in(std::int64_t low, std::int64_t high) {
    switch (random_() % 4) {
      case 0:
        return low;
      case 1:
        return high;
      default:
        return low + static_cast<std::int64_t>(random_() % (static_cast<std::uint64_t>(high - low) + 1));
    }
  }
  Fixed::Value value(Range r) { return {{static_cast<std::int32_t>(in(r.low, r.high))}}; }
  template <class R, class T>
  static void holds(const R& range, const T& number, const char* what) {
    ASSERT_LE(range.low, number.raw) << what;
    ASSERT_GE(range.high, number.raw) << what;
  }
};

TEST_F(IntervalsHold, EveryFunctionOfValues) {
  constexpr std::int64_t kTwo = std::int64_t{2} << fixed::kValueBits;
  for (int k = 0; k < 20'000; ++k) {
    const Range a = range(kTwo), b = range(kTwo);
    const Range limit{std::abs(b.low), std::abs(b.low)};
    const Fixed::Value x = value(a), y = value(b);
    const double g = std::ldexp(static_cast<double>(draw(1 << 30)), -28);
    const auto e = Fixed::exponent(std::min(3.0, std::abs(g)));  // powers below 11
    holds(a + b, x + y, "sum");
    holds(a - b, x - y, "difference");
    holds(-a, -x, "negative");
    holds(Intervals::times(a, b), Fixed::times(x, y), "times");
    holds(Intervals::scaled(Intervals::gain(g), a), Fixed::scaled(Fixed::gain(g), x), "scaled");
    holds(Intervals::gain(g) * a, Fixed::gain(g) * x, "gain");
    holds(Intervals::weight(g) * a, Fixed::weight(g) * x, "weight");
    holds(Intervals::magnitude(a), Fixed::magnitude(x), "magnitude");
    holds(Intervals::clamp(a, limit), Fixed::clamp(x, {{static_cast<std::int32_t>(limit.low)}}), "clamp");
    holds(Intervals::by_sign(a, b, a), Fixed::by_sign(x, y, x), "by_sign");
    holds(Intervals::sign(a), Fixed::sign(x), "sign");
    holds(Intervals::exp_negative(a), Fixed::exp_negative(x), "exp_negative");
    holds(Intervals::reciprocal(a), Fixed::reciprocal(x), "reciprocal");
    holds(Intervals::widen(a), Fixed::widen(x), "widen");
    holds(Intervals::narrow(Intervals::widen(a)), Fixed::narrow(Fixed::widen(x)), "narrow");
    const auto ratio_gain = Fixed::ratio_gain(100.0 * g);
    const auto ratios = Intervals::ratio(ratio_gain, a);
    const auto ratio = Fixed::ratio(ratio_gain, x);
    holds(Intervals::pow_abs(ratios, Fixed::exponent(0.3)), Fixed::pow_abs(ratio, Fixed::exponent(0.3)), "pow_abs");
    holds(Intervals::gauss(ratios), Fixed::gauss(ratio), "gauss");
    holds(Intervals::lorentzian(ratios), Fixed::lorentzian(ratio), "lorentzian");
    holds(Intervals::pow_abs(Intervals::widen(a), e), Fixed::pow_abs(Fixed::widen(x), e), "pow_abs");
  }
}

TEST_F(IntervalsHold, EveryFunctionOfStatesAndTravels) {
  constexpr std::int64_t kTwo = std::int64_t{2} << fixed::kValueBits;
  constexpr std::int64_t kOne = std::int64_t{1} << fixed::kStateBits;
  for (int k = 0; k < 20'000; ++k) {
    const Range a = range(kTwo), wide = range(kOne);
    const Intervals::State s{wide.low, wide.high};
    const Fixed::State state{{in(s.low, s.high)}};
    const Fixed::Value x = value(a);
    const Range t = Intervals::magnitude(range(static_cast<std::int64_t>(fixed::kLargestTravel)));
    const Intervals::Travel travels{static_cast<std::uint64_t>(t.low), static_cast<std::uint64_t>(t.high)};
    const fixed::Travel travel{static_cast<std::uint64_t>(in(t.low, t.high))};
    const auto e = Fixed::exponent(std::ldexp(static_cast<double>(draw(1 << 30)), -29));
    const auto q = Fixed::exponent(0.5 + std::abs(std::ldexp(static_cast<double>(draw(1 << 30)), -29)));
    holds(Intervals::times(s, a), Fixed::times(state, x), "times");
    holds(Intervals::step(travels, a), Fixed::step(travel, x), "step");
    holds(Intervals::clamp_to_one(s), Fixed::clamp_to_one(state), "clamp_to_one");
    holds(Intervals::bounded(s), Fixed::bounded(state), "bounded");
    const Fixed::Value limit = Fixed::magnitude(Fixed::Value{{static_cast<std::int32_t>(a.high)}});
    holds(Intervals::clamp(s, {limit.raw, limit.raw}), Fixed::clamp(state, limit), "clamp");
    ASSERT_LE(std::abs(Fixed::clamp(state, limit).raw), Fixed::widen(limit).raw);
    const auto share = Fixed::share(std::ldexp(static_cast<double>(random_() >> 11), -53));
    holds(Intervals::times(s, share), Fixed::times(state, share), "times share");
    const auto step_gain = Fixed::step_gain(std::ldexp(static_cast<double>(draw(1 << 30)), -20));
    const fixed::Step step{static_cast<std::int64_t>(random_()) >> (random_() % 63)};
    holds(Intervals::signal(step_gain, {}), Fixed::signal(step_gain, step), "signal");
    holds(Intervals::exp_negative(travels), Fixed::State(Fixed::exp_negative(travel)), "exp_negative");
    holds(Intervals::q_exp_negative(travels, q), Fixed::State(Fixed::q_exp_negative(travel, q)), "q_exp_negative");
    holds(Intervals::exp_mean(travels), Fixed::exp_mean(travel), "exp_mean");
    const Range size = Intervals::magnitude(a);
    const Fixed::Value positive = value(size);
    holds(Intervals::times(travels, size), Fixed::times(travel, positive), "travel times");
    holds(Intervals::over(travels, size), Fixed::over(travel, positive), "over");
    holds(Intervals::times_power(travels, s, e), Fixed::times_power(travel, state, e), "times_power");
    const auto g = Fixed::gain(7.0);
    holds(Intervals::travel({g}, size), Fixed::travel(g, positive), "travel");
  }
}

}  // namespace
}  // namespace flexspline::tests::fixed_system_test
