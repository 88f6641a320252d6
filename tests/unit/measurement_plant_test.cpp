// What is measured on the plant, whose equations are written apart: linear against the eigenvalues of its matrix, and
// with dry friction.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>

#include "hil/plant/two_mass.hpp"
#include "host/engine/measurement/measure.hpp"
#include "tests/unit/measurement_signals.hpp"

namespace flexspline::measurement::measurement_plant_test {
namespace {

using data::Column;

constexpr double kSample = 1e-3;
constexpr std::size_t kPeriodSamples = 2000;
constexpr double kCounts = 65536.0;

// The demo drive's size, with the linear part of its effects alone.
plant::Physics linear_drive() {
  plant::Physics p;
  p.gear_ratio = 100.0;
  p.torque_constant = 0.0543;
  p.motor_inertia = 1.04e-4;
  p.friction.viscous = 3.6e-4;
  p.friction.gear_ratio = 100.0;
  p.transmission.stiffness = 6300.0;
  p.damping_torque = 8.0;
  p.damping_exponent = 1.0;
  p.output_inertia = 1.2;
  p.output_viscous = 0.5;
  return p;
}

// Undamped frequencies and damping ratios of the oscillating poles; with the motor held, those of the zeros.
std::vector<std::pair<double, double>> poles(const plant::Physics& p, bool output_locked, bool motor_held) {
  const double n = p.gear_ratio, k = p.transmission.stiffness, c = p.damping_torque;
  Eigen::Matrix4d a = Eigen::Matrix4d::Zero();  // motor angle, its velocity, output angle, its velocity
  if (!motor_held) {
    a(0, 1) = 1.0;
    a.row(1) << -k / (n * n), -c / (n * n) - p.friction.viscous, k / n, c / n;
    a.row(1) /= p.motor_inertia;
  }
  if (!output_locked) {
    a(2, 3) = 1.0;
    a.row(3) << k / n, c / n, -k, -c - p.output_viscous;
    a.row(3) /= p.output_inertia;
  }
  std::vector<std::pair<double, double>> found;
  const Eigen::Vector4cd eigenvalues = a.eigenvalues();
  for (const std::complex<double> pole : eigenvalues)
    if (pole.imag() > 1e-6) found.emplace_back(std::abs(pole) / tests::kTwoPi, -pole.real() / std::abs(pole));
  return found;
}

// A multisine of the current about a mean, held from sample to sample, and what the sensors read of it.
data::Dataset record(const plant::Physics& physics, bool locked, double amplitude_a, double mean_a, unsigned seed) {
  const auto lines = tests::multisine(121, amplitude_a, seed);
  const std::size_t samples = 7 * kPeriodSamples;
  data::Dataset dataset;
  dataset.drive.gear_ratio = physics.gear_ratio;
  data::Experiment e = tests::experiment_of(samples, kSample);
  e.load = locked ? data::Load::locked : data::Load::free;
  e.current_hold = data::CurrentHold::zoh;
  e.encoder_counts = kCounts;
  e[Column::current_command] = tests::signal_of(lines, kPeriodSamples * kSample, kSample, samples);
  for (double& i : e[Column::current_command]) i += mean_a;
  e[Column::current] = e[Column::current_command];
  tests::add_noise(e[Column::current], 2e-3, seed + 1);
  plant::TwoMass drive(physics, locked);
  for (const double current : e[Column::current_command]) {
    const double quantum = tests::kTwoPi / kCounts;
    e[Column::motor_position].push_back(quantum * std::round(drive.state().motor_angle / quantum));
    e[Column::torque].push_back(drive.torque());
    drive.advance({current, 30.0, 0.0}, kSample, 16);
  }
  tests::add_noise(e[Column::torque], 0.01, seed + 2);
  dataset.experiments.push_back(std::move(e));
  return dataset;
}

TEST(MeasuredPlant, ShowsBothItsPolesAndItsZerosWhenFree) {
  const plant::Physics physics = linear_drive();
  const Measurement m = measure(record(physics, false, 0.05, 0.0, 31));
  ASSERT_FALSE(m.pooled.empty());
  EXPECT_EQ(m.pooled[0].response.output, "motor_velocity_rad_s");
  const auto& found = m.pooled[0].resonances.found;
  ASSERT_EQ(found.size(), 2u);
  const auto zero = poles(physics, false, true), pole = poles(physics, false, false);
  ASSERT_EQ(zero.size(), 1u);
  ASSERT_EQ(pole.size(), 1u);
  EXPECT_TRUE(found[0].anti);
  EXPECT_NEAR(found[0].frequency_hz, zero[0].first, 0.01 * zero[0].first);
  EXPECT_NEAR(found[0].damping, zero[0].second, 0.1 * zero[0].second);
  EXPECT_FALSE(found[1].anti);
  EXPECT_NEAR(found[1].frequency_hz, pole[0].first, 0.01 * pole[0].first);
  EXPECT_NEAR(found[1].damping, pole[0].second, 0.1 * pole[0].second);
}

TEST(MeasuredPlant, ShowsItsPolesWhenLocked) {
  plant::Physics physics = linear_drive();
  const Measurement m = measure(record(physics, true, 0.05, 0.0, 32));
  const auto pole = poles(physics, true, false);
  ASSERT_EQ(pole.size(), 1u);
  // Of velocity, torque and torsion alike.
  ASSERT_EQ(m.pooled.size(), 3u);
  for (const PooledResponse& p : m.pooled) {
    ASSERT_EQ(p.resonances.found.size(), 1u) << p.response.output;
    EXPECT_NEAR(p.resonances.found[0].frequency_hz, pole[0].first, 0.01 * pole[0].first) << p.response.output;
    EXPECT_NEAR(p.resonances.found[0].damping, pole[0].second, 0.1 * pole[0].second) << p.response.output;
  }
}

TEST(MeasuredPlant, HasNoDistortionWhileItIsLinear) {
  const Measurement m = measure(record(linear_drive(), false, 0.05, 0.0, 33));
  for (const Distortion& d : m.records[0].distortion) {
    ASSERT_TRUE(d.odd && d.even) << d.output;
    EXPECT_FALSE(d.odd->significant) << d.output << " " << d.odd->level_db << " " << d.odd->noise_db;
    EXPECT_FALSE(d.even->significant) << d.output << " " << d.even->level_db << " " << d.even->noise_db;
  }
}

TEST(MeasuredPlant, WithDryFrictionHasOddDistortionAndWithAsymmetryEvenToo) {
  plant::Physics physics = linear_drive();
  physics.friction.coulomb = 0.008;
  const Measurement symmetric = measure(record(physics, false, 0.05, 0.0, 34));
  const Distortion& odd = symmetric.records[0].distortion.at(0);
  ASSERT_TRUE(odd.odd && odd.even);
  EXPECT_TRUE(odd.odd->significant);
  EXPECT_GT(odd.odd->level_db, -40.0);
  EXPECT_GT(odd.odd->level_db, odd.even->level_db + 15.0);
  ASSERT_EQ(symmetric.notes.size(), 1u);
  EXPECT_NE(symmetric.notes[0].find("reverses"), std::string::npos);

  physics.friction.coulomb_asymmetry = 0.003;
  const Measurement skewed = measure(record(physics, false, 0.05, 0.0, 34));
  const Distortion& both = skewed.records[0].distortion.at(0);
  ASSERT_TRUE(both.odd && both.even);
  EXPECT_TRUE(both.odd->significant);
  EXPECT_TRUE(both.even->significant);
  EXPECT_GT(both.even->level_db, odd.even->level_db + 10.0);
}

TEST(MeasuredPlant, WithACubicSpringHasOddDistortionOfTheTorsion) {
  plant::Physics physics = linear_drive();
  physics.transmission.cubic_stiffness = 4e8;
  const Measurement m = measure(record(physics, true, 0.05, 0.0, 35));
  const auto torsion = std::find_if(m.records[0].distortion.begin(), m.records[0].distortion.end(),
                                    [](const Distortion& d) { return d.output == "torsion_rad"; });
  ASSERT_NE(torsion, m.records[0].distortion.end());
  ASSERT_TRUE(torsion->odd && torsion->even);
  EXPECT_TRUE(torsion->odd->significant);
  EXPECT_FALSE(torsion->even->significant) << torsion->even->level_db << " " << torsion->even->noise_db;
}

TEST(MeasuredPlant, ShowsItsPolesUnderAVelocityControllerThatKeepsItFromSticking) {
  plant::Physics physics = linear_drive();
  physics.friction.coulomb = 0.008;
  const auto lines = tests::multisine(121, 0.4, 36);
  const std::size_t samples = 7 * kPeriodSamples;
  data::Dataset dataset;
  data::Experiment e = tests::experiment_of(samples, kSample);
  e.current_hold = data::CurrentHold::zoh;
  e.encoder_counts = kCounts;
  e[Column::velocity_command] = tests::signal_of(lines, kPeriodSamples * kSample, kSample, samples);
  plant::TwoMass drive(physics, false);
  std::mt19937 random(37);
  std::normal_distribution<double> noise(0.0, 0.05);
  double integral = 0.0;
  for (double& command : e[Column::velocity_command]) {
    command += 30.0;
    const double error = command - drive.state().motor_velocity + noise(random);
    integral += 1.0 * error * kSample;
    const double current = 0.02 * error + integral, quantum = tests::kTwoPi / kCounts;
    e[Column::current].push_back(current);
    e[Column::motor_position].push_back(quantum * std::round(drive.state().motor_angle / quantum));
    drive.advance({current, 30.0, 0.0}, kSample, 16);
  }
  dataset.experiments.push_back(std::move(e));
  const Measurement m = measure(dataset);
  EXPECT_EQ(m.records[0].period->from, "velocity_command_rad_s");
  const auto& found = m.pooled.at(0).resonances.found;
  const auto zero = poles(physics, false, true), pole = poles(physics, false, false);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].frequency_hz, zero[0].first, 0.02 * zero[0].first);
  EXPECT_NEAR(found[1].frequency_hz, pole[0].first, 0.02 * pole[0].first);
  EXPECT_TRUE(m.notes.empty());
  // The friction never changes its sign.
  EXPECT_FALSE(m.records[0].distortion.at(0).odd->significant);
  EXPECT_FALSE(m.records[0].distortion.at(0).even->significant);
}

}  // namespace
}  // namespace flexspline::measurement::measurement_plant_test
