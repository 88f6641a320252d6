// Excitations: frequencies to a billionth, levels of all lines against Fourier series, limits that hold, and the
// drive's numbers against double.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "host/common/numbers/real.hpp"
#include "shared/control/excitation.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"

namespace flexspline::tests::control_excitation_test {
namespace {

using control::Excitation;
using control::ExcitationSetup;
using control::Shape;
using fixed::Checked;
using fixed::Fixed;
using fixed::OverflowLog;
using numbers::Real;

constexpr double kPi = std::numbers::pi;
constexpr double kTickS = 1.0 / 16384.0;
constexpr double kBase = 0.5;  // N m
constexpr std::uint32_t kCycle = 2048;

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.torque_base = kBase;
  d.velocity_base = 200.0;
  d.time_base = kTickS;
  return d;
}
// Eight cycles of 2048 ticks, 0.3 of the base, without fades; slopes as steep as a jump.
ExcitationSetup<double> plain() {
  ExcitationSetup<double> setup;
  setup.amplitude = 0.3 * kBase;
  setup.frequency_hz = 8.0;
  setup.ticks = 8 * kCycle;
  setup.limit = kBase;
  setup.slope_limit = 4.0 * kBase / kTickS;
  return setup;
}
ExcitationSetup<double> shaped(Shape shape) {
  auto setup = plain();
  setup.shape = shape;
  return setup;
}
double real(double x) {
  return x;
}
double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
// In bases, tick by tick until it has finished.
template <class N>
std::vector<double> played(const ExcitationSetup<double>& setup) {
  const auto c = Excitation::derive<N>(setup, kBase, drive());
  Excitation::State<N> s;
  Excitation::start(s, c);
  std::vector<double> out;
  do {
    out.push_back(real(Excitation::update(s, c, {})));
  } while (!Excitation::finished(s) && out.size() < 10'000'000);
  out.pop_back();  // the first zero after the end
  return out;
}
// Coefficient of exp(i h phase), relative to the amplitude; h cycles of a cycle of the excitation.
std::complex<double> line(const std::vector<double>& y, int h, std::uint32_t cycle = kCycle, double amplitude = 0.3) {
  std::complex<double> sum = 0.0;
  for (std::size_t k = 0; k < y.size(); ++k)
    sum += y[k] * std::polar(1.0, -2.0 * kPi * static_cast<double>((k * static_cast<std::size_t>(h)) % cycle) / cycle);
  return sum * (h == 0 ? 1.0 : 2.0) / (amplitude * static_cast<double>(y.size()));
}
// Of a sine a sin(h phase).
std::complex<double> sine_line(double a) {
  return {0.0, -a};
}

TEST(Excitation, FrequenciesAreExactToABillionth) {
  for (const double frequency : {0.01, 0.2, 0.5, 1.0, 33.3, 7999.0}) {
    auto setup = sine(plain());
    setup.frequency_hz = frequency;
    const auto c = Excitation::derive<Fixed>(setup, kBase, drive());
    const long double cycles = static_cast<long double>(frequency) * static_cast<long double>(kTickS);
    EXPECT_NEAR(static_cast<double>(std::ldexp(static_cast<long double>(c.step), -64) / cycles - 1.0L), 0.0, 1e-12);
  }
}

TEST(Excitation, SinesHaveOneLine) {
  const auto y = played<Fixed>(sine(plain())), inverted = played<Fixed>(inverted_sine(plain()));
  ASSERT_EQ(y.size(), plain().ticks);
  EXPECT_LT(std::abs(line(y, 1) - sine_line(1.0)), 1e-7);
  EXPECT_LT(std::abs(line(inverted, 1) - sine_line(-1.0)), 1e-7);
  for (const int h : {0, 2, 3, 17}) EXPECT_LT(std::abs(line(y, h)), 2e-8) << h;
}

TEST(Excitation, AnAsymmetricSineHasTheLinesOfItsHalves) {
  // 1.1 sin - 0.1 |sin|, and the Fourier series of |sin|.
  const auto y = played<Fixed>(shaped(Shape::asymmetric_sine));
  EXPECT_NEAR(line(y, 0).real(), -0.1 * 2.0 / kPi, 1e-6);
  EXPECT_LT(std::abs(line(y, 1) - sine_line(1.1)), 1e-7);
  EXPECT_LT(std::abs(line(y, 2) - 0.1 * 4.0 / (3.0 * kPi)), 1e-6);
  EXPECT_NEAR(*std::max_element(y.begin(), y.end()), 0.3, 1e-8);
  EXPECT_NEAR(*std::min_element(y.begin(), y.end()), -0.36, 1e-8);
}

// The series of sampled edges differ from those of continuous ones by the square of h/2048.
TEST(Excitation, SquareSawToothAndTriangleHaveTheLinesOfTheirSeries) {
  const auto square = played<Fixed>(shaped(Shape::square));
  const auto saw = played<Fixed>(shaped(Shape::saw_tooth));
  const auto triangle = played<Fixed>(shaped(Shape::triangle));
  for (int h = 1; h <= 9; ++h) {
    const double odd = h % 2 == 1 ? 1.0 : 0.0;
    // A sampled square holds each value over a tick: half a tick late.
    const auto held = std::polar(1.0, kPi * h / kCycle);
    EXPECT_LT(std::abs(line(square, h) - sine_line(odd * 4.0 / (kPi * h)) * held), 2e-4) << h;
    const double alternating = h % 2 == 1 ? 1.0 : -1.0;
    EXPECT_LT(std::abs(std::abs(line(saw, h)) - 2.0 / (kPi * h)), 2e-4) << h;
    EXPECT_GT(alternating * -line(saw, h).imag(), 0.0) << h;
    const double sign = h % 4 == 1 ? 1.0 : -1.0;
    EXPECT_LT(std::abs(line(triangle, h) - sine_line(odd * sign * 8.0 / (kPi * kPi * h * h))), 1e-5) << h;
  }
  for (const auto& y : {square, saw, triangle}) {
    EXPECT_LE(*std::max_element(y.begin(), y.end()), 0.3 + 1e-8);
    EXPECT_NEAR(*std::min_element(y.begin(), y.end()), -0.3, 4e-3 * 0.3);
  }
  EXPECT_NEAR(*std::max_element(triangle.begin(), triangle.end()), 0.3, 1e-8);
}

TEST(Excitation, TheCompositeIsEquationSixtyOverItsLargestMagnitude) {
  double peak = 0.0;
  for (int k = 0; k < 1'000'000; ++k) {
    const double t = 2.0 * kPi * k / 1e6;
    peak = std::max(peak, std::abs(std::cos(t) + 0.5 * std::sin(2.0 * t) + std::sin(3.0 * t)));
  }
  const auto y = played<Fixed>(composite(plain()));
  EXPECT_LT(std::abs(line(y, 1) - 1.0 / peak), 1e-7);
  EXPECT_LT(std::abs(line(y, 2) - sine_line(0.5 / peak)), 1e-7);
  EXPECT_LT(std::abs(line(y, 3) - sine_line(1.0 / peak)), 1e-7);
  EXPECT_LT(std::abs(line(y, 0)), 2e-8);
  EXPECT_LT(std::abs(line(y, 4)), 1e-8);
}

TEST(Excitation, TheChirpHasThePhaseOfTheContinuousOne) {
  auto setup = sine(plain());
  setup.frequency_hz = 0.5;
  setup.end_frequency_hz = 200.0;
  setup.ticks = 10 * 16384;
  const auto y = played<Fixed>(setup);
  ASSERT_EQ(y.size(), setup.ticks);
  double worst = 0.0;
  for (std::size_t k = 0; k < y.size(); ++k) {
    const double t = static_cast<double>(k) * kTickS;
    worst = std::max(worst, std::abs(y[k] - 0.3 * std::sin(2.0 * kPi * (0.5 + 0.5 * 199.5 / 10.0 * t) * t)));
  }
  EXPECT_LT(worst, 1e-8);
  // And downwards.
  std::swap(setup.frequency_hz, setup.end_frequency_hz);
  const auto down = played<Fixed>(setup);
  const double t = 9.0;
  EXPECT_NEAR(down[9 * 16384], 0.3 * std::sin(2.0 * kPi * (200.0 - 0.5 * 199.5 / 10.0 * t) * t), 1e-8);
}

TEST(Excitation, AMultiSineHasTheLinesWantedAtOneLevelAndNoOthers) {
  const auto setup = multi_sine(plain(), {.seed = 42, .first = 3, .last = 40, .odd = true, .omit_one_of = 4});
  std::set<int> wanted;
  for (std::size_t i = 0; i < setup.line_count; ++i) wanted.insert(setup.lines[i].harmonic);
  // 19 odd lines from 3 to 39: of every four one is left out.
  EXPECT_GE(wanted.size(), 14u);
  EXPECT_LE(wanted.size(), 15u);
  for (const int h : wanted) EXPECT_EQ(h % 2, 1);
  for (int group = 3; group + 6 <= 33; group += 8) {
    int left = 0;
    for (int h = group; h <= group + 6; h += 2) left += wanted.contains(h) ? 1 : 0;
    EXPECT_EQ(left, 3) << group;
  }
  const auto y = played<Fixed>(setup);
  const double level = std::abs(line(y, *wanted.begin()));
  EXPECT_GT(level, 0.5 / static_cast<double>(wanted.size()));
  for (int h = 0; h < 60; ++h) EXPECT_NEAR(std::abs(line(y, h)), wanted.contains(h) ? level : 0.0, 1e-7) << h;
  double peak = 0.0;
  for (const double x : y) peak = std::max(peak, std::abs(x));
  EXPECT_LT(peak, 0.3 + 1e-8);
  EXPECT_GT(peak, 0.298);
}

// Against a search in double, sixteen times as dense: no sum of lines exceeds its amplitude between the ticks either.
TEST(Excitation, PeaksOfMultiSinesAreFoundToAMillionth) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    auto setup = multi_sine(plain(), {.seed = seed, .first = 1, .last = 24});
    ASSERT_EQ(setup.line_count, 24u);
    double peak = 0.0;
    for (int k = 0; k < 24 * 1024; ++k) {
      double sum = 0.0;
      for (std::size_t i = 0; i < setup.line_count; ++i)
        sum += std::sin(2.0 * kPi *
                        (setup.lines[i].harmonic * (k / (24.0 * 1024.0)) +
                         std::ldexp(static_cast<double>(setup.lines[i].phase), -32)));
      peak = std::max(peak, std::abs(sum));
    }
    EXPECT_NEAR(control::detail::peak_of_lines(setup) / peak, 1.0, 1e-5);
    EXPECT_GE(control::detail::peak_of_lines(setup), peak * (1.0 - 1e-7));
  }
}

TEST(Excitation, TheSameSeedGivesTheSamePhasesAndAnotherSeedOthers) {
  const auto a = multi_sine(plain(), {.seed = 9}), b = multi_sine(plain(), {.seed = 9}),
             c = multi_sine(plain(), {.seed = 10});
  int same = 0;
  for (std::size_t i = 0; i < a.line_count; ++i) {
    EXPECT_EQ(a.lines[i].phase, b.lines[i].phase);
    same += a.lines[i].phase == c.lines[i].phase ? 1 : 0;
  }
  EXPECT_EQ(same, 0);
  EXPECT_EQ(control::SplitMix(1234567).next(), 6457827717110365317U);  // published with the algorithm
}

TEST(Excitation, FadesInAndOutAndLastsAsManyTicksAsSaid) {
  auto setup = sine(plain());
  setup.offset = 0.2 * kBase;
  setup.fade_ticks = 1000;
  const auto y = played<Fixed>(setup);
  EXPECT_LE(y.size(), setup.ticks);
  EXPECT_GE(y.size(), setup.ticks - 1);
  for (const std::size_t k : {0u, 1u, 250u, 999u, 1000u, 5000u, 16384u - 1000u, 16384u - 300u}) {
    const double x = std::min({1.0, static_cast<double>(k) / 1000.0, static_cast<double>(16384 - k) / 1000.0});
    const double expected =
        x * x * (3.0 - 2.0 * x) * (0.2 + 0.3 * std::sin(2.0 * kPi * static_cast<double>(k) / kCycle));
    EXPECT_NEAR(y[k], expected, 2e-8) << k;
  }
}

TEST(Excitation, ASquareBecomesATrapezoidOfTheSlopeAllowedAndEndsAtZero) {
  auto setup = shaped(Shape::square);
  setup.slope_limit = 0.3 * kBase / (100 * kTickS);
  const auto y = played<Fixed>(setup);
  EXPECT_EQ(y.size(), setup.ticks + 99);  // 100 ticks back to zero, of which the last shows as the end
  EXPECT_NEAR(y[49], 0.15, 1e-7);
  EXPECT_NEAR(y[1024 + 99], 0.0, 1e-7);
  double slope = 0.0;
  for (std::size_t k = 1; k < y.size(); ++k) slope = std::max(slope, std::abs(y[k] - y[k - 1]));
  EXPECT_LE(slope, 0.3 / 100 + 1e-8);
}

TEST(Excitation, StopsAtOnceAsFastAsItsSlopeAllows) {
  auto setup = sine(plain());
  setup.slope_limit = 20.0 * kBase;
  const auto c = Excitation::derive<Fixed>(setup, kBase, drive());
  Excitation::State<Fixed> s;
  Excitation::start(s, c);
  for (int k = 0; k < 512; ++k) Excitation::update(s, c, {});
  Excitation::stop(s);
  int ticks = 0;
  for (; !Excitation::finished(s) && ticks < 10'000; ++ticks) Excitation::update(s, c, {});
  EXPECT_NEAR(ticks, 0.3 / 20.0 / kTickS, 2.0);
}

// Any shape with any amplitude, velocities as bad as can be.
TEST(Excitation, KeepsToItsLimitsForAHundredThousandAdversarialTicks) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  OverflowLog::clear();
  double closest = 0.0;
  int braking = 0;
  for (int run = 0; run < 100; ++run) {
    auto setup = shaped(static_cast<Shape>(run % 5));
    if (setup.shape == Shape::lines) setup = multi_sine(setup, {.seed = random(), .first = 1, .last = 12});
    setup.amplitude = 3.0 * uniform(random) * kBase;
    setup.offset = uniform(random) * kBase;
    setup.limit = (0.1 + uniform(random)) * kBase;
    setup.slope_limit = std::pow(10.0, 1.0 + 3.0 * uniform(random)) * kBase;
    setup.velocity_limit = 100.0;
    setup.overspeed = 120.0;
    setup.ticks = 900;
    const bool clipped = setup.offset + 1.2 * setup.amplitude > setup.limit;
    const auto c = Excitation::derive<Checked>(setup, kBase, drive());
    EXPECT_TRUE(OverflowLog::count() == 1 || !clipped);  // reported, and clipped nevertheless
    OverflowLog::clear();
    Excitation::State<Checked> s;
    Excitation::start(s, c);
    double before = 0.0;
    for (int k = 0; k < 1000; ++k) {
      const auto velocity = static_cast<std::int32_t>(random()) >> (random() % 8);
      const double y = real(Excitation::update(s, c, Checked::Value{{velocity}}));
      ASSERT_LE(std::abs(y), setup.limit / kBase + 1e-8);
      ASSERT_LE(std::abs(y - before), setup.slope_limit / kBase * kTickS + 1e-8);
      closest = std::max(closest, std::abs(y) * kBase / setup.limit);
      braking += y * velocity < 0.0 ? 1 : 0;
      before = y;
    }
    EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  }
  EXPECT_GT(closest, 0.999);
  EXPECT_GT(braking, 1000);
}

// A motor without friction under half its torque limit: it would pass any speed.
TEST(Excitation, AGuardedTorqueDoesNotAccelerateAMotorBeyondItsOverspeed) {
  auto setup = sine(plain());
  setup.offset = 0.5 * kBase;
  setup.frequency_hz = 0.5;
  setup.ticks = 10 * 16384;
  setup.velocity_limit = 100.0;
  setup.overspeed = 120.0;
  const auto c = Excitation::derive<Fixed>(setup, kBase, drive());
  Excitation::State<Fixed> s;
  Excitation::start(s, c);
  double velocity = 0.0, fastest = 0.0;
  for (std::uint32_t k = 0; k < setup.ticks; ++k) {
    velocity += kTickS * real(Excitation::update(s, c, Fixed::value(velocity / 200.0))) * kBase / 1e-4;
    fastest = std::max(fastest, velocity);
  }
  EXPECT_LT(fastest, 120.0);
  EXPECT_GT(fastest, 100.0);
}

TEST(Excitation, OnADriveAgreesWithDouble) {
  auto chirp = sine(plain());
  chirp.end_frequency_hz = 300.0;
  const auto many = multi_sine(plain(), {.seed = 5, .first = 1, .last = 63, .odd = true});
  OverflowLog::clear();
  double all = 0.0;
  for (auto setup : {sine(plain()), composite(plain()), chirp, many, shaped(Shape::asymmetric_sine),
                     shaped(Shape::square), shaped(Shape::saw_tooth), shaped(Shape::triangle)}) {
    setup.fade_ticks = 700;
    const auto y = played<Fixed>(setup), checked = played<Checked>(setup), exact = played<Real>(setup);
    ASSERT_EQ(y, checked);
    double worst = 0.0;
    for (std::size_t k = 0; k < std::min(y.size(), exact.size()); ++k)
      worst = std::max(worst, std::abs(y[k] - exact[k]));
    EXPECT_LT(worst, 3e-8);
    all = std::max(all, worst);
  }
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  EXPECT_GT(all, 0.0);
}

TEST(Excitation, ReportsWhatItCannotPlay) {
  const auto found = [](const ExcitationSetup<double>& setup) {
    OverflowLog::clear();
    Excitation::derive<Fixed>(setup, kBase, drive());
    return OverflowLog::count() > 0;
  };
  EXPECT_FALSE(found(sine(plain())));
  auto setup = sine(plain());
  setup.frequency_hz = 9000.0;
  EXPECT_TRUE(found(setup));
  setup = multi_sine(plain(), {.seed = 1, .first = 1, .last = 30});
  setup.frequency_hz = 300.0;
  EXPECT_TRUE(found(setup));
  setup = sine(plain());
  setup.amplitude = 1.1 * setup.limit;
  EXPECT_TRUE(found(setup));
  setup = sine(plain());
  setup.fade_ticks = setup.ticks;
  EXPECT_TRUE(found(setup));
  OverflowLog::clear();
  multi_sine(plain(), {.seed = 1, .first = 1, .last = 40});
  EXPECT_EQ(OverflowLog::count(), 1);
}

}  // namespace
}  // namespace flexspline::tests::control_excitation_test
