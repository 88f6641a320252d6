// Sections 4.1 and 4.3 of the report: velocity from an encoder by a Kalman filter, as "direct differentiation from
// the signal gives a very poor estimate". Counts of 4096 a turn, the filter in the numbers of the drive, against the
// backward difference behind a low-pass of first order, or a moving average, of the filter's own group delay; and what
// a low-pass reaches that may be as slow as it likes.
//
// Group delay is measured on the counts: the phase between estimate and truth of two sines (1 and 2 Hz, where the
// motions below have their power), over the distance of both.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "host/common/numbers/real.hpp"
#include "shared/fixed/system.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/observers/encoder_kalman.hpp"

namespace flexspline::tests::kalman_filter_test {
namespace {

using fixed::Fixed;
using numbers::Real;
using observers::EncoderKalman;

constexpr double kCounts = 4096.0;
constexpr double kSettledS = 4.0;
constexpr double kEndS = 12.0;
using Signal = std::vector<double>;

// A filter on a drive, and the largest velocity of its motions.
struct Setting {
  std::string name;
  double tick_s;
  double corner_hz;
  double velocity_base;
};
const Setting kMotorSide{"motor side, 16 kHz, corner 50 Hz", 1.0 / 16000.0, 50.0, 200.0};
// As in the report: the encoder is on the load, sampled at 1 kHz.
const Setting kLoadSide{"load side, 1 kHz, corner 15 Hz", 1e-3, 15.0, 2.0};

struct Motion {
  std::string name;
  std::function<double(double)> position;  // rad at time t
  std::function<double(double)> velocity;
};
std::string named(const char* shape, double velocity) {
  char name[64];
  std::snprintf(name, sizeof name, "%s %g rad/s", shape, velocity);
  return name;
}
Motion sine(double frequency_hz, double amplitude) {
  const double w = kTurn * frequency_hz;
  return {named("sine", amplitude), [=](double t) { return amplitude / w * (1.0 - std::cos(w * t)); },
          [=](double t) { return amplitude * std::sin(w * t); }};
}
// Velocity goes up and down in straight lines, once a second.
Motion triangle(double amplitude) {
  const auto velocity = [](double t) { return std::abs(4.0 * (t - std::floor(t)) - 2.0) - 1.0; };
  const auto position = [](double t) {
    const double from_middle = t - std::floor(t) - 0.5;
    return 2.0 * from_middle * std::abs(from_middle) - from_middle;
  };
  return {named("triangle", amplitude), [=](double t) { return amplitude * position(t); },
          [=](double t) { return amplitude * velocity(t); }};
}
Motion constant(double velocity) {
  return {named("constant", velocity), [=](double t) { return velocity * t; }, [=](double) { return velocity; }};
}

struct Run {
  Signal truth, kalman, difference;
};
effects::DriveConstants<double> drive(const Setting& setting) {
  effects::DriveConstants<double> d;
  d.velocity_base = setting.velocity_base;
  d.acceleration_base = 20.0 * setting.velocity_base;
  d.angle_base = kTurn;
  d.time_base = setting.tick_s;
  return d;
}
// `offset`: where within a count the motion starts.
Run run(const Setting& setting, const Motion& motion, double offset) {
  const auto d = drive(setting);
  const auto c = EncoderKalman::derive<Fixed>(observers::setup_for_corner(kCounts, kTurn * setting.corner_hz, d), d);
  EncoderKalman::State<Fixed> state;
  Run r;
  std::int64_t before = 0;
  const int ticks = static_cast<int>(std::lround(kEndS / setting.tick_s));
  for (int k = 0; k < ticks; ++k) {
    const double t = k * setting.tick_s;
    const auto count = static_cast<std::int64_t>(std::floor(motion.position(t) / kTurn * kCounts + offset));
    const auto now = EncoderKalman::update<Fixed>(state, c, {count * (std::int64_t{1} << 20)});
    r.truth.push_back(motion.velocity(t));
    r.kalman.push_back(std::ldexp(now.velocity.raw, -fixed::kValueBits) * setting.velocity_base);
    r.difference.push_back(k == 0 ? 0.0 : static_cast<double>(count - before) * kTurn / kCounts / setting.tick_s);
    before = count;
  }
  return r;
}
// First order, y += share (u - y): its group delay at low frequency is (1/share - 1) ticks, beside half a tick of the
// difference.
Signal low_pass(const Signal& x, double share) {
  Signal y;
  double now = 0.0;
  for (const double u : x) y.push_back(now += share * (u - now));
  return y;
}
// The mean of `ticks` differences, which is half of them late.
Signal moving_average(const Signal& x, std::size_t ticks) {
  Signal y;
  double sum = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    sum += x[k] - (k < ticks ? 0.0 : x[k - ticks]);
    y.push_back(sum / static_cast<double>(ticks));
  }
  return y;
}
// Root mean square of the error, once settled; with `later`, of the estimate that comes so many ticks later.
double rms(const Signal& estimate, const Signal& truth, double tick_s, std::size_t later = 0) {
  double sum = 0.0;
  std::size_t count = 0;
  for (auto k = static_cast<std::size_t>(kSettledS / tick_s); k + later < truth.size(); ++k, ++count)
    sum += std::pow(estimate[k + later] - truth[k], 2);
  return std::sqrt(sum / static_cast<double>(count));
}
double phase(const Signal& x, const Signal& truth, double frequency_hz, double tick_s) {
  std::complex<double> given = 0.0, wanted = 0.0;
  for (auto k = static_cast<std::size_t>(kSettledS / tick_s); k < x.size(); ++k) {
    const auto turn = std::polar(1.0, -kTurn * frequency_hz * tick_s * static_cast<double>(k));
    given += x[k] * turn;
    wanted += truth[k] * turn;
  }
  return std::arg(given / wanted);
}
// Group delay at 1 to 2 Hz, measured on counts.
double delay_of(const Setting& setting, const std::function<Signal(const Run&)>& estimate) {
  const auto at = [&](double frequency_hz) {
    const Run r = run(setting, sine(frequency_hz, 0.5 * setting.velocity_base), 0.3);
    return phase(estimate(r), r.truth, frequency_hz, setting.tick_s);
  };
  return (at(1.0) - at(2.0)) / kTurn;
}
// The largest group delay up to the corner, from the filter's answer to one count in double.
double largest_delay_in_band(const Setting& setting) {
  const auto d = drive(setting);
  const auto c = EncoderKalman::derive<Real>(observers::setup_for_corner(kCounts, kTurn * setting.corner_hz, d), d);
  EncoderKalman::State<Real> state;
  Signal response;
  EncoderKalman::update<Real>(state, c, 0.0);
  const int ticks = static_cast<int>(40.0 / (kTurn * setting.corner_hz * setting.tick_s));
  for (int k = 0; k < ticks; ++k) response.push_back(EncoderKalman::update<Real>(state, c, 1.0).velocity);
  double largest = 0.0;
  for (double share = 0.02; share <= 1.0; share += 0.02) {
    std::complex<double> sum = 0.0, moment = 0.0;
    for (std::size_t k = 0; k < response.size(); ++k) {
      const double ticks_back = static_cast<double>(k);
      const auto part = std::polar(response[k], -kTurn * share * setting.corner_hz * setting.tick_s * ticks_back);
      sum += part;
      moment += part * ticks_back;
    }
    // Against the velocity at the reading, half a tick after the middle of the step that caused it.
    largest = std::max(largest, ((moment / sum).real() + 0.5) * setting.tick_s);
  }
  return largest;
}

struct Errors {
  double kalman = 0.0;
  double moving_average = 0.0;      // over whole ticks, so up to half a tick later than the filter
  double same_delay = 0.0;          // the low-pass that has the filter's delay at low frequency
  double same_delay_in_band = 0.0;  // one that has its largest delay, without the error of that delay: noise and shape
  double best = 0.0;                // the best of all, chosen for each motion with the truth at hand
  double best_delay_s = 0.0;
};
Errors errors(const Setting& setting, const Motion& motion, double share, double delay_in_band_s) {
  const double t = setting.tick_s;
  std::mt19937 random(7001);
  Errors e;
  constexpr int kRuns = 3;
  std::vector<double> candidates;
  for (double s = 1.0; s > 1e-4; s *= 0.8) candidates.push_back(s);
  Signal candidate_squares(candidates.size());
  const auto square = [](double x) { return x * x / kRuns; };
  for (int k = 0; k < kRuns; ++k) {
    const Run r = run(setting, motion, std::uniform_real_distribution<double>(0.0, 1.0)(random));
    e.kalman += square(rms(r.kalman, r.truth, t));
    e.same_delay += square(rms(low_pass(r.difference, share), r.truth, t));
    e.moving_average += square(
        rms(moving_average(r.difference, static_cast<std::size_t>(std::ceil(2.0 / share - 1.0 - 1e-9))), r.truth, t));
    const double slow_ticks = delay_in_band_s / t - 0.5;
    e.same_delay_in_band += square(rms(low_pass(r.difference, 1.0 / (1.0 + slow_ticks)), r.truth, t,
                                       static_cast<std::size_t>(std::lround(slow_ticks + 0.5))));
    for (std::size_t n = 0; n < candidates.size(); ++n)
      candidate_squares[n] += square(rms(low_pass(r.difference, candidates[n]), r.truth, t));
  }
  const auto best = std::min_element(candidate_squares.begin(), candidate_squares.end());
  e.best = std::sqrt(*best);
  e.best_delay_s = t * (1.0 / candidates[static_cast<std::size_t>(best - candidate_squares.begin())] - 0.5);
  for (double* x : {&e.kalman, &e.same_delay, &e.moving_average, &e.same_delay_in_band}) *x = std::sqrt(*x);
  return e;
}

// A setting with both group delays measured, and the low-pass that makes them the same.
struct Comparison {
  explicit Comparison(const Setting& of) : setting(of), delay_in_band_s(largest_delay_in_band(of)) {
    const double delay = delay_of(setting, [](const Run& r) { return r.kalman; });
    // The difference alone is half a tick late; what is left of the delay goes to the low-pass.
    share = 1.0 / (1.0 + std::max(0.0, delay / setting.tick_s - 0.5));
    const double plain_delay = delay_of(setting, [&](const Run& r) { return low_pass(r.difference, share); });
    std::printf(
        "%s: group delay at 1 to 2 Hz %.0f us, of plain differentiation %.0f us; largest below the corner %.2f ms\n",
        setting.name.c_str(), 1e6 * delay, 1e6 * plain_delay, 1e3 * delay_in_band_s);
    // The same, or half a tick, which is the least there is.
    EXPECT_GT(plain_delay, 0.97 * delay);
    EXPECT_LT(plain_delay, std::max(1.03 * delay, 0.52 * setting.tick_s));
  }
  Errors of(const Motion& motion) const {
    const Errors e = errors(setting, motion, share, delay_in_band_s);
    std::printf(
        "  %-18s rms rad/s: Kalman %.4f, low-pass %.4f (%.1f times), moving average %.4f; low-pass with %.2f ms of "
        "delay taken back %.4f (%.2f times); best low-pass in hindsight %.4f (%.2f times, %.2f ms late)\n",
        motion.name.c_str(), e.kalman, e.same_delay, e.same_delay / e.kalman, e.moving_average, 1e3 * delay_in_band_s,
        e.same_delay_in_band, e.same_delay_in_band / e.kalman, e.best, e.best / e.kalman, 1e3 * e.best_delay_s);
    return e;
  }
  Setting setting;
  double delay_in_band_s;
  double share = 1.0;
};

TEST(Section43, OnTheMotorTheKalmanFilterHasAThirdOfPlainDifferentiationsErrorAtItsDelay) {
  const Comparison comparison(kMotorSide);
  for (const Motion& motion : {sine(1.0, 100.0), sine(1.0, 1.0), triangle(100.0), triangle(1.0), constant(5.0),
                               constant(0.5), constant(0.05), constant(0.02)}) {
    const Errors e = comparison.of(motion);
    EXPECT_LE(e.kalman, std::min(e.same_delay, e.moving_average) / 3.0) << motion.name;
  }
}
TEST(Section43, OnTheLoadTheKalmanFilterHasAThirdOfPlainDifferentiationsErrorAtItsDelay) {
  const Comparison comparison(kLoadSide);
  for (const Motion& motion :
       {sine(1.0, 1.0), sine(0.5, 0.2), triangle(1.0), triangle(0.2), constant(0.5), constant(0.05)}) {
    const Errors e = comparison.of(motion);
    EXPECT_LE(e.kalman, std::min(e.same_delay, e.moving_average) / 3.0) << motion.name;
  }
}

// Where counts come more slowly than the filter forgets them, each becomes a pulse of its own, in either filter: of
// energy w for the filter of corner w (the integral of its answer squared), a/((2 - a) T) for the low-pass. Their ratio
// is all that can be gained then, and at 15 Hz and 1 kHz it is less than nine.
TEST(Section43, BelowACountPerMemoryAThirdIsOutOfReachAndTheRatioIsThatOfThePulsesEnergies) {
  const Comparison comparison(kLoadSide);
  const Errors e = comparison.of(constant(0.005));
  const double corner = kTurn * kLoadSide.corner_hz;
  const double energies = comparison.share / (2.0 - comparison.share) / kLoadSide.tick_s / corner;
  EXPECT_LT(energies, 9.0);
  EXPECT_NEAR(e.same_delay / e.kalman, std::sqrt(energies), 0.1 * std::sqrt(energies));
  EXPECT_GT(e.same_delay / e.kalman, 2.0);
}

}  // namespace
}  // namespace flexspline::tests::kalman_filter_test
