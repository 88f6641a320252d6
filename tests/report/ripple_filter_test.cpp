// Section 5.3 of the report: "a Kalman filter estimation of the torque ripples, using simple harmonic oscillator model,
// can accurately estimate the torque ripples". The twin's torque sensor has a ripple of order two (twice a turn of the
// wave generator); the filter runs in the numbers of the drive on what the twin records, encoder counts, noise and all.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <vector>

#include "hil/plant/parameters.hpp"
#include "hil/plant/recorder.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/observers/ripple_filter.hpp"

namespace flexspline::tests {
namespace {

using fixed::Checked;
using observers::RippleFilter;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kMemoryTurns = 20.0;

struct Recorded {
  plant::Drive drive;
  plant::Record record;
};
Recorded record(plant::Waveform waveform, double amplitude, double frequency_hz, double duration_s) {
  plant::PlantFile file = plant::demo_plant();
  plant::with(file.drive, "torque_sensor_ripple");
  plant::ExperimentPlan plan;
  plan.name = "free motion";
  plan.mode = plant::Mode::velocity;
  plan.waveform = waveform;
  plan.amplitude = amplitude;
  plan.frequency_hz = frequency_hz;
  plan.duration_s = duration_s;
  return {file.drive, plant::record_one(file.drive, plan, 7001, 0)};
}

// Over the second half of the record.
double rms(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0.0;
  const std::size_t half = x.size() / 2;
  for (std::size_t k = half; k < x.size(); ++k) sum += std::pow(x[k] - y[k], 2);
  return std::sqrt(sum / static_cast<double>(x.size() - half));
}

// What is left of the ripple, as a share of it: rms error after the filter, less the sensor's noise.
double left_of_the_ripple(plant::Waveform waveform, double amplitude, double frequency_hz, const char* name,
                          double duration_s = 12.0) {
  const Recorded r = record(waveform, amplitude, frequency_hz, duration_s);
  effects::DriveConstants<double> d;
  d.output_torque_base = r.drive.rated_torque_nm;
  d.angle_base = kTurn;
  const auto c = RippleFilter::derive<Checked>(
      observers::RippleSetup<double>{.order = 2.0, .memory = kMemoryTurns * kTurn, .largest_ripple = 1.0}, d);
  RippleFilter::State<Checked> state;
  fixed::OverflowLog::clear();
  std::vector<double> filtered;
  for (std::size_t k = 0; k < r.record.torque_nm.size(); ++k) {
    const double turns = r.record.motor_position_rad[k] / kTurn;
    const auto out = RippleFilter::update<Checked>(state, c, {std::llround(std::ldexp(turns, fixed::kAngleBits))},
                                                   Checked::value(r.record.torque_nm[k] / d.output_torque_base));
    filtered.push_back(std::ldexp(out.raw, -fixed::kValueBits) * d.output_torque_base);
  }
  EXPECT_EQ(fixed::OverflowLog::count(), 0) << fixed::OverflowLog::first();
  const double before = rms(r.record.torque_nm, r.record.truth.torque_nm);
  const double after = rms(filtered, r.record.truth.torque_nm);
  const double noise = r.record.torque_noise_std;
  const auto newton_metres = [&](fixed::State x) {
    return std::ldexp(static_cast<double>(x.raw), -fixed::kStateBits) * d.output_torque_base;
  };
  const auto without_noise = [&](double x) { return std::sqrt(std::max(0.0, x * x - noise * noise)); };
  const double left = without_noise(after) / without_noise(before);
  std::printf(
      "%s: torque off by %.4f N m rms, filtered by %.4f, noise alone %.4f: %.3f of the ripple left; cosine %.4f "
      "(true 0.18), sine %.4f (0.24)\n",
      name, before, after, noise, left, newton_metres(state.cosine), newton_metres(state.sine));
  EXPECT_NEAR(without_noise(before), 0.3 / std::sqrt(2.0), 0.01);  // the ripple is there to be taken out
  return left;
}

TEST(Section53, TheHarmonicOscillatorEstimatesTheRippleInFreeMotionToATenth) {
  EXPECT_LT(left_of_the_ripple(plant::Waveform::sine, 100.0, 0.5, "sine"), 0.1);
  EXPECT_LT(left_of_the_ripple(plant::Waveform::triangle, 100.0, 0.5, "triangle"), 0.1);
  EXPECT_LT(left_of_the_ripple(plant::Waveform::trapezoid, 100.0, 0.25, "trapezoid"), 0.1);
}

// What counts is travel, not time: twelve seconds of slow motion are two memories of the filter, and show it.
TEST(Section53, SlowMotionTakesLongerToTheSameEnd) {
  const double early = left_of_the_ripple(plant::Waveform::sine, 30.0, 0.5, "slow sine, 12 s");
  EXPECT_LT(early, 0.4);
  EXPECT_GT(early, 0.1);
  EXPECT_LT(left_of_the_ripple(plant::Waveform::sine, 30.0, 0.5, "slow sine, 60 s", 60.0), 0.1);
}

}  // namespace
}  // namespace flexspline::tests
