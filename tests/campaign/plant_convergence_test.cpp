// The plant is the truth of every campaign, so its own error must not be seen: halving the step may change no signal by
// more than a tenth of what its sensor can resolve.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "hil/plant/parameters.hpp"
#include "hil/plant/recorder.hpp"
#include "tests/support/campaign_size.hpp"

namespace flexspline::plant::plant_convergence_test {
namespace {

constexpr double kShareOfNoise = 0.1;
constexpr double kShareOfCount = 0.1;

std::vector<double> difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> d(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) d[k] = a[k] - b[k];
  return d;
}

double rms(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double value : x) sum += value * value;
  return std::sqrt(sum / static_cast<double>(x.size()));
}

/// Largest magnitude once mean and linear trend are taken away.
double largest_without_drift(std::vector<double> x) {
  const auto n = static_cast<double>(x.size());
  const double middle = 0.5 * (n - 1.0);
  double mean = 0.0, moment = 0.0, square = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double t = static_cast<double>(k) - middle;
    mean += x[k] / n;
    moment += t * x[k];
    square += t * t;
  }
  double largest = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double t = static_cast<double>(k) - middle;
    largest = std::max(largest, std::abs(x[k] - mean - moment / square * t));
  }
  return largest;
}

std::vector<std::string> hidden_effects() {
  std::vector<std::string> names = {"nothing"};
  for (const Effect& effect : demo_plant().drive.effects) {
    const bool base = effect.type == "inertia" || effect.type == "linear_stiffness" ||
                      effect.type == "viscous_friction" || effect.type == "coulomb_friction" ||
                      effect.type.starts_with("output_");
    if (!base) names.push_back(effect.label());
  }
  return names;
}

class PlantConvergence : public ::testing::TestWithParam<std::string> {};

/// By how much two ways to step through the same experiments differ at the worst, in what sensors can resolve.
struct Worst {
  double velocity = 0.0, torque = 0.0;  // of the noise
  double motor = 0.0, output = 0.0;     // counts
};
Worst worst_between(const PlantFile& file, const Drive& one, const Drive& other) {
  Worst worst;
  for (std::size_t i = 0; i < file.experiments.size(); ++i) {
    const Record a = record_one(one, file.experiments[i], 1, i);
    const Record b = record_one(other, file.experiments[i], 1, i);
    const double turn = 2.0 * std::numbers::pi;
    worst.velocity =
        std::max(worst.velocity,
                 rms(difference(a.truth.motor_velocity_rad_s, b.truth.motor_velocity_rad_s)) / a.tachometer_noise_std);
    worst.torque = std::max(worst.torque, rms(difference(a.truth.torque_nm, b.truth.torque_nm)) / a.torque_noise_std);
    worst.motor = std::max(worst.motor,
                           largest_without_drift(difference(a.truth.motor_position_rad, b.truth.motor_position_rad)) *
                               one.sensors.motor_counts / turn);
    worst.output = std::max(
        worst.output, largest_without_drift(difference(a.truth.output_position_rad, b.truth.output_position_rad)) *
                          one.sensors.output_counts / turn);
  }
  ::testing::Test::RecordProperty("worst_velocity_share_of_noise", std::to_string(worst.velocity));
  ::testing::Test::RecordProperty("worst_torque_share_of_noise", std::to_string(worst.torque));
  ::testing::Test::RecordProperty("worst_motor_position_counts", std::to_string(worst.motor));
  ::testing::Test::RecordProperty("worst_output_position_counts", std::to_string(worst.output));
  return worst;
}
Drive drive_of(const PlantFile& file, const std::string& hidden) {
  Drive drive = file.drive;
  if (hidden != "nothing") hide(drive, hidden);
  drive.sensors.has_tachometer = true;
  return drive;
}

TEST_P(PlantConvergence, HalvingTheStepChangesLessThanSensorsCanResolve) {
  const PlantFile file = demo_plant();
  const Drive drive = drive_of(file, GetParam());
  Drive halved = drive;
  halved.steps_per_sample = 2 * drive.steps_per_sample;
  ASSERT_LE(drive.sample_s / drive.steps_per_sample, 1e-3 / 16.0 * (1.0 + 1e-12));
  const Worst worst = worst_between(file, drive, halved);
  EXPECT_LT(worst.velocity, kShareOfNoise);
  EXPECT_LT(worst.torque, kShareOfNoise);
  EXPECT_LT(worst.motor, kShareOfCount);
  EXPECT_LT(worst.output, kShareOfCount);
}

// A drive in closed loop whose tick is an eighth of a millisecond takes one step for each (hil/board/plant_rig.cpp).
TEST_P(PlantConvergence, AStepOfAnEighthOfAMillisecondDiffersByLessThanSensorsCanResolve) {
  const PlantFile file = demo_plant();
  Drive coarse = drive_of(file, GetParam());
  Drive fine = coarse;
  coarse.steps_per_sample = static_cast<int>(std::lround(coarse.sample_s / 125e-6));
  fine.steps_per_sample = 4 * coarse.steps_per_sample;
  const Worst worst = worst_between(file, coarse, fine);
  EXPECT_LT(worst.velocity, kShareOfNoise);
  EXPECT_LT(worst.torque, kShareOfNoise);
  EXPECT_LT(worst.motor, kShareOfCount);
  EXPECT_LT(worst.output, kShareOfCount);
}

INSTANTIATE_TEST_SUITE_P(Hidden, PlantConvergence, ::testing::ValuesIn(tests::part_of(hidden_effects(), 8)),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::replace_if(
                               name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
                           return name;
                         });

}  // namespace
}  // namespace flexspline::plant::plant_convergence_test
