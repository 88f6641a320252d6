// Section 5.3 of the report: "a Kalman filter estimation of the torque ripples, using simple harmonic oscillator model,
// can accurately estimate the torque ripples". The twin's torque sensor has a ripple of order two (twice a turn of the
// wave generator); the filter runs in the numbers of the drive on what the twin records, encoder counts, noise and all.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "hil/plant/parameters.hpp"
#include "hil/plant/recorder.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/observers/riccati.hpp"
#include "shared/observers/ripple_filter.hpp"

namespace flexspline::tests::ripple_filter_test {
namespace {

using fixed::Checked;
using observers::RippleFilter;

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

// The Kalman filter that computes its covariance at every sample, with the same ratio of variances, in double: mean,
// cosine and sine. What the fixed gains cost is the difference to it.
std::vector<double> with_full_kalman(const std::vector<double>& torque, const std::vector<double>& angle_rad,
                                     double noise_variance) {
  Eigen::Vector3d x(torque.front(), 0.0, 0.0);
  Eigen::Matrix3d p = Eigen::Matrix3d::Identity();  // N^2 m^2, above any ripple here
  std::vector<double> filtered;
  for (std::size_t k = 0; k < torque.size(); ++k) {
    const double travel = k == 0 ? 0.0 : std::abs(angle_rad[k] - angle_rad[k - 1]);
    const double step = 1.0 - std::exp(-3.0 * travel / (kMemoryTurns * kTurn));
    p.diagonal() += noise_variance * step * step / 9.0 * Eigen::Vector3d(1.0, 2.0, 2.0);
    const Eigen::Vector3d c(1.0, std::cos(2.0 * angle_rad[k]), std::sin(2.0 * angle_rad[k]));
    const Eigen::Vector3d gain = p * c / (c.dot(p * c) + noise_variance);
    x += gain * (torque[k] - c.dot(x));
    p -= gain * (c.transpose() * p);
    filtered.push_back(torque[k] - (c.dot(x) - x[0]));
  }
  return filtered;
}

// Over the second half of the record.
double rms(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0.0;
  const std::size_t half = x.size() / 2;
  for (std::size_t k = half; k < x.size(); ++k) sum += std::pow(x[k] - y[k], 2);
  return std::sqrt(sum / static_cast<double>(x.size() - half));
}

// What is left of the ripple, as a share of it: rms error after the filter, less the sensor's noise.
struct Left {
  double fixed = 0.0, full_kalman = 0.0;
};
Left left_of_the_ripple(plant::Waveform waveform, double amplitude, double frequency_hz, const char* name,
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
  const double by_full_kalman =
      without_noise(rms(with_full_kalman(r.record.torque_nm, r.record.motor_position_rad, noise * noise),
                        r.record.truth.torque_nm)) /
      without_noise(before);
  std::printf(
      "%s: torque off by %.4f N m rms, filtered by %.4f, noise alone %.4f: %.3f of the ripple left; cosine %.4f "
      "(true 0.18), sine %.4f (0.24); full Kalman filter %.3f left\n",
      name, before, after, noise, left, newton_metres(state.cosine), newton_metres(state.sine), by_full_kalman);
  EXPECT_NEAR(without_noise(before), 0.3 / std::sqrt(2.0), 0.01);  // the ripple is there to be taken out
  return {left, by_full_kalman};
}

// Gains of the steady-state Kalman filter on a harmonic oscillator with a mean, whose phase advances by `advance` a
// sample: of the mean, of the part in phase with the oscillator, and of the part a quarter turn ahead. The states are
// random walks with the variances `mean_walk` and `amplitude_walk` a sample; the measurement has white noise of
// variance 1.
std::array<double, 3> kalman_oscillator(double advance, double mean_walk, double amplitude_walk) {
  // The measurement, mean + in phase, is the first state, as steady_covariance() has it.
  const double c = std::cos(advance), s = std::sin(advance);
  const observers::Matrix3<double> a{{{1.0, c - 1.0, s}, {0.0, c, s}, {0.0, -s, c}}};
  const observers::Matrix3<double> q{{{mean_walk + amplitude_walk, amplitude_walk, 0.0},
                                      {amplitude_walk, amplitude_walk, 0.0},
                                      {0.0, 0.0, amplitude_walk}}};
  const auto gain = observers::steady_gain<double, 3>(observers::steady_covariance<double, 3>(a, q, 1.0), 1.0);
  return {gain[0] - gain[1], gain[1], gain[2]};
}

// The filter's gains are fixed by its memory. They are those of a steady-state Kalman filter whose amplitudes walk with
// twice the variance of the mean, up to the ratio of a period to the memory.
TEST(Section53, TheFilterHasTheGainsOfASteadyStateKalmanFilterOnAnOscillator) {
  for (const double speed_rad_s : {10.0, 100.0, 300.0}) {
    const double travel = 1e-3 * speed_rad_s;
    const double step = 1.0 - std::exp(-3.0 * travel / (kMemoryTurns * kTurn));
    const auto gain = kalman_oscillator(2.0 * travel, step * step / 9.0, 2.0 * step * step / 9.0);
    std::printf("%g rad/s: mean %.4f of the filter's, in phase %.4f of the filter's, ahead %.4f of the in-phase gain\n",
                speed_rad_s, gain[0] / (step / 3.0), gain[1] / (2.0 * step / 3.0), gain[2] / gain[1]);
    EXPECT_NEAR(gain[0] / (step / 3.0), 1.0, 0.01);
    EXPECT_NEAR(gain[1] / (2.0 * step / 3.0), 1.0, 0.01);
    EXPECT_NEAR(gain[2] / gain[1], 0.0, 0.01);
  }
}

TEST(Section53, TheHarmonicOscillatorEstimatesTheRippleInFreeMotionToATenth) {
  EXPECT_LT(left_of_the_ripple(plant::Waveform::sine, 100.0, 0.5, "sine").fixed, 0.1);
  EXPECT_LT(left_of_the_ripple(plant::Waveform::triangle, 100.0, 0.5, "triangle").fixed, 0.1);
  EXPECT_LT(left_of_the_ripple(plant::Waveform::trapezoid, 100.0, 0.25, "trapezoid").fixed, 0.1);
}

// What counts is travel, not time: twelve seconds of slow motion are two memories of the filter, and show it. A Kalman
// filter that computes its covariance converges there; later it is no better.
TEST(Section53, SlowMotionTakesLongerToTheSameEndWithFixedGains) {
  const Left early = left_of_the_ripple(plant::Waveform::sine, 30.0, 0.5, "slow sine, 12 s");
  EXPECT_LT(early.fixed, 0.4);
  EXPECT_GT(early.fixed, 0.1);
  EXPECT_LT(early.full_kalman, 0.1);
  const Left late = left_of_the_ripple(plant::Waveform::sine, 30.0, 0.5, "slow sine, 60 s", 60.0);
  EXPECT_LT(late.fixed, 0.1);
  EXPECT_NEAR(late.full_kalman, late.fixed, 0.05);
}

}  // namespace
}  // namespace flexspline::tests::ripple_filter_test
