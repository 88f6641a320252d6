// The ripple filter: what it takes out and what it leaves, that it cannot grow, and its numbers against double.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "host/common/numbers/real.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/intervals.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/observers/ripple_filter.hpp"

namespace flexspline::tests::observers_ripple_test {
namespace {

using fixed::Checked;
using fixed::Fixed;
using fixed::Intervals;
using fixed::OverflowLog;
using numbers::Real;
using observers::RippleFilter;

constexpr double kTickS = 1.0 / 16000.0;
constexpr double kRipple = 0.05;  // of the torque base
constexpr double kPhase = 0.7;
constexpr double kMemoryTurns = 10.0;

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.output_torque_base = 40.0;
  d.angle_base = kTurn;
  d.time_base = kTickS;
  return d;
}
template <class N>
RippleFilter::Coefficients<N> filter(double order, double largest = 0.25) {
  return RippleFilter::derive<N>(
      {.order = order, .memory = kMemoryTurns * kTurn, .largest_ripple = largest * drive().output_torque_base},
      drive());
}
double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
double real(fixed::State x) {
  return std::ldexp(static_cast<double>(x.raw), -fixed::kStateBits);
}
fixed::Angle angle(double turns) {
  return {std::llround(std::ldexp(turns, fixed::kAngleBits))};
}
double ripple(double turns, double order = 2.0) {
  return kRipple * std::cos(kTurn * order * turns + kPhase);
}

// The filter on a drive along turns(k), with torque(turns, k); returns the largest distance of its output from
// wanted(turns, k), over the ticks from `first` on.
template <class Turns, class Torque, class Wanted>
double worst_after(RippleFilter::State<Fixed>& s, const RippleFilter::Coefficients<Fixed>& c, int ticks, int first,
                   Turns&& turns, Torque&& torque, Wanted&& wanted) {
  double worst = 0.0;
  for (int k = 0; k < ticks; ++k) {
    const double at = turns(k);
    const double given = real(RippleFilter::update<Fixed>(s, c, angle(at), Fixed::value(torque(at, k))));
    if (k >= first) worst = std::max(worst, std::abs(given - wanted(at, k)));
  }
  return worst;
}

TEST(RippleFilter, TakesARippleOfOrderTwoOutAtAnySteadySpeed) {
  for (const double turns_per_second : {30.0, 2.0, -8.0}) {
    const auto c = filter<Fixed>(2.0);
    RippleFilter::State<Fixed> s;
    // From the second memory of the filter on, 1/e of what was left before at each.
    const int memory = static_cast<int>(kMemoryTurns / std::abs(turns_per_second) / kTickS);
    const auto turns = [&](int k) { return 0.3 + turns_per_second * kTickS * k; };
    const double left = worst_after(
        s, c, 6 * memory, 5 * memory, turns, [](double at, int) { return 0.4 + ripple(at); },
        [](double, int) { return 0.4; });
    EXPECT_LT(left, 0.01 * kRipple) << turns_per_second;
    EXPECT_GT(left, std::exp(-7.0) * kRipple) << turns_per_second;  // no faster than its memory says
    // And to the resolution of a signal, in the end.
    const auto later = [&](int k) { return turns(6 * memory + k); };
    EXPECT_LT(worst_after(
                  s, c, 16 * memory, 15 * memory, later, [](double at, int) { return 0.4 + ripple(at); },
                  [](double, int) { return 0.4; }),
              1e-6 * kRipple + 5e-8)
        << turns_per_second;
  }
}

TEST(RippleFilter, LeavesAStepOfTheTorqueWhereItIs) {
  const auto c = filter<Fixed>(2.0);
  RippleFilter::State<Fixed> s;
  const auto turns = [](int k) { return 10.0 * kTickS * k; };
  const int step = 160'000;  // a hundred turns
  const auto load = [&](int k) { return k < step ? 0.2 : 0.7; };
  const auto torque = [&](double at, int k) { return load(k) + ripple(at); };
  const auto wanted = [&](double, int k) { return load(k); };
  // At once it is off by a few hundredths of the step: a step holds a little of every order.
  EXPECT_LT(worst_after(s, c, step + 1, step, turns, torque, wanted), 1e-3 * 0.5);
  double mean = 0.0, worst = 0.0;
  const int window = 1600 * 10;  // ten turns from the step on
  for (int k = step + 1; k <= step + window; ++k) {
    const double off =
        real(RippleFilter::update<Fixed>(s, c, angle(turns(k)), Fixed::value(torque(turns(k), k)))) - 0.7;
    mean += off / window;
    worst = std::max(worst, std::abs(off));
  }
  EXPECT_LT(worst, 0.05 * 0.5);
  EXPECT_NEAR(mean, 0.0, 1e-3 * 0.5);
}

TEST(RippleFilter, LeavesTheRippleOfAnotherOrder) {
  const auto c = filter<Fixed>(2.0);
  RippleFilter::State<Fixed> s;
  const auto turns = [](int k) { return 20.0 * kTickS * k; };
  const double off = worst_after(
      s, c, 80'000, 60'000, turns, [](double at, int) { return ripple(at, 3.0); },
      [](double at, int) { return ripple(at, 3.0); });
  EXPECT_LT(off, 0.03 * kRipple);
}

TEST(RippleFilter, KeepsWhatItKnowsThroughStandstillAndReversal) {
  const auto c = filter<Fixed>(2.0);
  RippleFilter::State<Fixed> s;
  const auto torque = [](double at, int) { return ripple(at); };
  const auto none = [](double, int) { return 0.0; };
  worst_after(
      s, c, 160'000, 0, [](int k) { return 20.0 * kTickS * k; }, torque, none);
  const double end = 20.0 * kTickS * 160'000;
  // At rest the torque changes, and passes to the last bit.
  const auto before = RippleFilter::update<Fixed>(s, c, angle(end), Fixed::value(0.0));
  const auto cosine = s.cosine.raw, sine = s.sine.raw;
  for (int k = 1; k < 1000; ++k) {
    const Fixed::Value loaded{{static_cast<std::int32_t>(k) * 100'000}};
    ASSERT_EQ(RippleFilter::update<Fixed>(s, c, angle(end), loaded).raw, before.raw + loaded.raw);
  }
  EXPECT_EQ(s.cosine.raw, cosine);
  EXPECT_EQ(s.sine.raw, sine);
  // Back at another speed: nothing to be learnt again.
  EXPECT_LT(worst_after(
                s, c, 16'000, 0, [&](int k) { return end - 7.0 * kTickS * k; }, torque, none),
            1e-3 * kRipple);
}

TEST(RippleFilter, OnADriveAgreesWithDoubleForAHundredThousandTicks) {
  for (const double order : {1.0, 2.0, 3.07, 104.0}) {
    const auto c = filter<Fixed>(order);
    const auto c_checked = filter<Checked>(order);
    const auto c_exact = filter<Real>(order);
    RippleFilter::State<Fixed> s;
    RippleFilter::State<Checked> s_checked;
    RippleFilter::State<Real> s_exact;
    OverflowLog::clear();
    double worst = 0.0, largest = 0.0;
    for (int k = 0; k < 100'000; ++k) {
      const double t = k * kTickS;
      const fixed::Angle at = angle(15.0 * std::sin(2.0 * t) + 0.5 * std::sin(40.0 * t));
      const double turns = std::ldexp(static_cast<double>(at.raw), -fixed::kAngleBits);
      const auto torque = Fixed::value(0.6 * std::sin(3.0 * t) + ripple(turns, order));
      const auto now = RippleFilter::update<Fixed>(s, c, at, torque);
      const auto checked = RippleFilter::update<Checked>(s_checked, c_checked, at, {{torque.raw}});
      const double exact = RippleFilter::update<Real>(s_exact, c_exact, turns, real(torque));
      ASSERT_EQ(now.raw, checked.raw);
      worst = std::max(worst, std::abs(real(now) - exact));
      largest = std::max(largest, std::abs(exact));
    }
    EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
    EXPECT_LT(worst, 1e-7) << order;
    EXPECT_GT(worst, 0.0);
    EXPECT_GT(largest, 0.5);
  }
}

TEST(RippleFilter, CannotGrowWhateverItIsGiven) {
  std::mt19937_64 random(5);
  const auto c = filter<Checked>(2.0, 0.25);
  RippleFilter::State<Checked> s;
  OverflowLog::clear();
  double largest = 0.0;
  std::int64_t at = 0;
  for (int k = 0; k < 200'000; ++k) {
    // Jumps of any size, and torques that always push the same way.
    const std::int64_t jump = static_cast<std::int64_t>(random()) >> (random() % 64);
    at = static_cast<std::int64_t>(static_cast<std::uint64_t>(at) + static_cast<std::uint64_t>(jump));
    const double push =
        std::cos(kTurn * 2.0 * std::ldexp(static_cast<double>(at & 0xFFFFFFFF), -32)) > 0.0 ? 2.0 : -2.0;
    RippleFilter::update<Checked>(s, c, {at}, Checked::value(push));
    largest = std::max({largest, std::abs(real(s.cosine)), std::abs(real(s.sine))});
    ASSERT_LE(largest, 0.25);
  }
  EXPECT_EQ(largest, 0.25);  // it did push against the bound
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
}

// States are widened tick by tick until a tick no longer widens them.
bool proven(double largest) {
  const auto c = filter<Intervals>(2.0, largest);
  constexpr std::int64_t kTwo = std::int64_t{2} << fixed::kValueBits;
  RippleFilter::State<Intervals> s;
  OverflowLog::clear();
  for (int k = 0; k < 100; ++k) {
    const RippleFilter::State<Intervals> before = s;
    RippleFilter::update<Intervals>(s, c, {}, {-kTwo, kTwo});
    bool wider = false;
    for (const auto member : {&RippleFilter::State<Intervals>::mean, &RippleFilter::State<Intervals>::cosine,
                              &RippleFilter::State<Intervals>::sine}) {
      const auto both = fixed::hull(before.*member, s.*member);
      wider = wider || both.low != (before.*member).low || both.high != (before.*member).high;
      s.*member = both;
    }
    if (OverflowLog::count() != 0) return false;
    if (!wider) return true;
  }
  return false;
}

TEST(RippleFilter, IntervalsProveThatItKeepsItsRangeForRipplesUpToOneAndAHalfBases) {
  EXPECT_TRUE(proven(0.1));
  EXPECT_TRUE(proven(1.5));
  EXPECT_FALSE(proven(7.5));
}

TEST(RippleFilter, ARippleLargerThanStatedIsTakenOutUpToWhatIsStated) {
  const auto c = filter<Fixed>(2.0, 0.5 * kRipple);
  RippleFilter::State<Fixed> s;
  const auto turns = [](int k) { return 20.0 * kTickS * k; };
  worst_after(
      s, c, 80'000, 0, turns, [](double at, int) { return ripple(at); }, [](double, int) { return 0.0; });
  EXPECT_NEAR(real(s.cosine), 0.5 * kRipple, 1e-8);
  EXPECT_LE(std::abs(real(s.sine)), 0.5 * kRipple);
}

}  // namespace
}  // namespace flexspline::tests::observers_ripple_test
