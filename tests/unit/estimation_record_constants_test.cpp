// Torsions that are counted from another zero in every recording.
#include "host/engine/estimation/record_constants.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/engine/comparison/compare.hpp"
#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation::estimation_record_constants_test {
namespace {

using data::Column;

constexpr double kPi = 3.14159265358979323846, kGear = 100.0, kStiffness = 6300.0, kCubic = 6e7, kDamping = 8.0;
constexpr double kZeros[] = {2.0e-4, -1.0e-4, 5.0e-5};

// A locked output: the torque is what the model makes of the twist, written down and not simulated.
data::Experiment locked(int index, double zero) {
  data::Experiment e;
  e.name = "locked-" + std::to_string(index);
  e.sample_s = 1e-3;
  e.load = data::Load::locked;
  e.current_hold = data::CurrentHold::none;
  for (int k = 0; k < 6000; ++k) {
    const double t = 1e-3 * k, w1 = 2.0 * kPi * (0.4 + 0.1 * index), w2 = 2.0 * kPi * 1.7;
    const double q = 0.10 * std::sin(w1 * t) + 0.03 * std::sin(w2 * t + index);
    const double v = 0.10 * w1 * std::cos(w1 * t) + 0.03 * w2 * std::cos(w2 * t + index);
    const double twist = q / kGear + zero;
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(0.0);
    e[Column::torque].push_back(kStiffness * twist + kCubic * twist * twist * twist + kDamping * v / kGear);
  }
  e.segments = {{0, 6000}};
  e.masked.assign(6000, 0);
  return e;
}

data::Dataset recordings() {
  data::Dataset dataset;
  for (int i = 0; i < 3; ++i) dataset.experiments.push_back(locked(i, kZeros[i]));
  return dataset;
}

model::Model spring(bool with_zero) {
  model::Model model;
  model.drive.gear_ratio.value = kGear;
  model.drive.torque_constant_nm_a.value = 0.05;
  for (const char* type : {"linear_stiffness", "cubic_stiffness", "structural_damping"})
    model.effects.push_back(catalogue::blank_effect(catalogue::get(type), data::Axis::rotary));
  model::Parameter& exponent = *model.find("structural_damping")->find("exponent");
  exponent.value = 1.0;
  exponent.fixed = true;
  if (with_zero) model.effects.push_back(catalogue::blank_effect(catalogue::get("torsion_zero"), data::Axis::rotary));
  return model;
}

const Estimate& of(const Identification& found, std::string_view effect) {
  for (const Estimate& e : found.estimates)
    if (e.effect == effect) return e;
  throw std::out_of_range(std::string(effect));
}

const PipelineOptions kFilters{40.0, true};

// Each record has a zero of its own.
const Identification& with_zeros() {
  static const auto found = identify(recordings(), spring(true), kFilters);
  return *found;
}

TEST(TorsionZero, IsFoundForEveryRecordAndLeavesTheStiffnessAsItIs) {
  const Identification& found = with_zeros();
  const Estimate& zero = of(found, "torsion_zero");
  ASSERT_EQ(zero.per_experiment.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(*zero.per_experiment[i].value, kZeros[i], 2e-6) << i;
  EXPECT_NEAR(*zero.average, (kZeros[0] + kZeros[1] + kZeros[2]) / 3.0, 2e-6);
  EXPECT_FALSE(zero.reliable) << "it is meant to differ: no verdict";
  EXPECT_NEAR(of(found, "linear_stiffness").value / kStiffness, 1.0, 2e-3);
  EXPECT_NEAR(of(found, "cubic_stiffness").value / kCubic, 1.0, 2e-2);
  EXPECT_LT(found.fits.front().rmse(), 0.02);
}

TEST(TorsionZero, ThatIsOneForAllRecordsCouldNotDoThat) {
  // The same torsions as one recording with gaps have one zero.
  const auto without = identify(recordings(), spring(false), kFilters);
  EXPECT_GT(without->fits.front().rmse(), 20.0 * with_zeros().fits.front().rmse());
}

TEST(TorsionZero, OfRecordsThatWereNotFittedIsFoundByCompare) {
  data::Dataset fresh;
  fresh.experiments = {locked(3, 3e-4), locked(4, -2e-4)};
  const auto comparison = comparison::compare(fresh, with_zeros().model, kFilters);
  const comparison::SignalResult* balance = comparison.find_overall("transmission_balance");
  ASSERT_NE(balance, nullptr);
  EXPECT_LT(balance->rmse, 0.03);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_record_constants_test
