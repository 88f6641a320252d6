// host/engine/comparison: the noise floor against records without noise.
#include "host/engine/comparison/noise_floor.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>

#include "host/engine/estimation/balance_fit.hpp"
#include "tests/unit/comparison_test_drive.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::comparison::comparison_noise_floor_test {
namespace {

using estimation::Balance;
using estimation::RegressionProblem;
using plant::Mode;
using plant::Waveform;

constexpr double kCutoffHz = 30.0;

struct Recorded {
  plant::Drive drive;
  data::Dataset measured, again, noiseless;
  Recorded(plant::Drive d, const std::vector<plant::ExperimentPlan>& plans) : drive(std::move(d)) {
    // The loop acts on the true motion, so another seed gives the same motion with other sensor noise.
    for (const plant::Record& r : plant::record_all(drive, plans, 1)) {
      measured.experiments.push_back(experiment_of(r, drive));
      noiseless.experiments.push_back(noiseless_experiment_of(r, drive));
    }
    again = record(drive, plans, 2);
  }
};

std::vector<plant::ExperimentPlan> plans() {
  return {plan("periodic", Mode::velocity, Waveform::sine, 60.0, 2.0, 6.0),
          plan("once", Mode::velocity, Waveform::sine, 60.0, 0.45, 4.0),
          plan("locked", Mode::current, Waveform::sine, 2.0, 0.45, 4.0, true),
          plan("rest", Mode::off, Waveform::zero, 0.0, 1.0, 2.0)};
}

const Recorded& recorded() {
  static const Recorded r(plant::demo_plant().drive, plans());
  return r;
}

estimation::PreparedData prepared(const data::Dataset& dataset, const model::Model& m) {
  estimation::PipelineOptions options;
  options.cutoff_hz = kCutoffHz;
  return estimation::prepare(pointers(dataset), m, options);
}

std::vector<NoiseFloor> floors_of(const data::Dataset& dataset, const model::Model& m, Balance balance) {
  const estimation::PreparedData p = prepared(dataset, m);
  RegressionProblem data(p, balance);
  return noise_floors(data, estimation::terms_of(m), pointers(dataset), m.drive);
}

// What sensor noise and resolution do to the residual: RMS of its difference from that of noiseless records.
std::vector<double> true_floors(const Recorded& r, const model::Model& m, Balance balance) {
  const estimation::PreparedData p = prepared(r.measured, m);
  estimation::PreparedData q = prepared(r.noiseless, m);
  for (std::size_t k = 0; k < p.records.size(); ++k) {
    q.records[k].rows = p.records[k].rows;
    q.records[k].at_rest = p.records[k].at_rest;
  }
  RegressionProblem a(p, balance), b(q, balance);
  const auto terms = estimation::terms_of(m);
  const Eigen::VectorXd d = a.residual(terms) - b.residual(terms);
  std::vector<double> floors;
  for (const auto& range : a.records())
    floors.push_back(std::sqrt(d.segment(range.first, range.size()).squaredNorm() / static_cast<double>(range.size())));
  return floors;
}

data::Dataset without_stated_noise(data::Dataset dataset) {
  for (data::Experiment& e : dataset.experiments) e.noise_std = {};
  return dataset;
}

TEST(NoiseFloor, OfEachBalanceIsWhatNoiseAndResolutionDoToTheResidual) {
  const model::Model m = known_model(recorded().drive);
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    const auto floors = floors_of(recorded().measured, m, balance);
    const auto truth = true_floors(recorded(), m, balance);
    ASSERT_EQ(floors.size(), truth.size());
    for (std::size_t k = 0; k < floors.size(); ++k) {
      ASSERT_TRUE(floors[k].rmse.has_value());
      EXPECT_NEAR(*floors[k].rmse / truth[k], 1.0, 0.2) << "balance " << static_cast<int>(balance) << " record " << k;
    }
  }
}

TEST(NoiseFloor, ComesFromPeriodsWhereTheMotionRepeatsAndFromTheColumnsElse) {
  const auto floors = floors_of(recorded().measured, known_model(recorded().drive), Balance::motor);
  ASSERT_EQ(floors.size(), 4u);
  EXPECT_EQ(floors[0].from, "periods");
  EXPECT_EQ(floors[1].from, "propagated");
  EXPECT_EQ(floors[2].from, "propagated");
  EXPECT_EQ(floors[3].from, "periods");  // at rest
}

TEST(NoiseFloor, IsNotKnownWhereNothingRepeatsAndNoNoiseIsStated) {
  const auto floors =
      floors_of(without_stated_noise(recorded().measured), known_model(recorded().drive), Balance::motor);
  EXPECT_EQ(floors[0].from, "periods");
  EXPECT_EQ(floors[1].from, "none");
  EXPECT_FALSE(floors[1].rmse.has_value());
}

TEST(NoiseFloor, ComesFromReplicatesWhereNoPeriodHelps) {
  data::Dataset both = without_stated_noise(recorded().measured);
  both.experiments.resize(3);
  for (const data::Experiment& e : recorded().again.experiments) {
    if (e.name != "once" && e.name != "locked") continue;
    both.experiments.push_back(e);
    both.experiments.back().noise_std = {};
    both.experiments.back().name = e.name + "-again";
    both.experiments.back().replicate_of = e.name;
  }
  const model::Model m = known_model(recorded().drive);
  const auto floors = floors_of(both, m, Balance::motor);
  const auto truth = true_floors(recorded(), m, Balance::motor);
  ASSERT_EQ(floors.size(), 5u);
  for (const std::size_t k : {1u, 2u}) {
    EXPECT_EQ(floors[k].from, "replicates");
    EXPECT_EQ(floors[k + 2].from, "replicates");
    EXPECT_NEAR(*floors[k + 2].rmse, *floors[k].rmse, 1e-3 * *floors[k].rmse);
    // The simulated motion is the same to the last digit, and with it what the encoder's steps leave: the difference
    // shows the other noise alone.
    EXPECT_LT(*floors[k].rmse / truth[k], 1.15);
  }
  EXPECT_NEAR(*floors[1].rmse / truth[1], 1.0, 0.15);
}

TEST(NoiseFloor, DoesNotCountAnEffectThatTheModelLacks) {
  plant::Drive drive = plant::demo_plant().drive;
  plant::hide(drive, "torque_ripple:2");
  const Recorded rippled(drive, {plans()[0], plans()[1]});
  const data::Dataset& dataset = rippled.measured;
  const model::Model m = known_model(drive);
  const estimation::PreparedData p = prepared(dataset, m);
  RegressionProblem data(p, Balance::motor);
  const auto terms = estimation::terms_of(m);
  const auto floors = noise_floors(data, terms, pointers(dataset), m.drive);
  const auto truth = true_floors(rippled, m, Balance::motor);
  const Eigen::VectorXd r = data.residual(terms);
  for (std::size_t k = 0; k < 2; ++k) {
    const auto& range = data.records()[k];
    const double rmse =
        std::sqrt(r.segment(range.first, range.size()).squaredNorm() / static_cast<double>(range.size()));
    EXPECT_GT(rmse, 4.0 * truth[k]);
    EXPECT_NEAR(*floors[k].rmse / truth[k], 1.0, 0.3) << floors[k].from;
  }
}

// The torsion zero of a record is no noise: the noisy copy of the record has it, too.
TEST(NoiseFloor, OfThePropagatedNoiseDoesNotChangeWithTheZeroOfTheTorsion) {
  const model::Model m = known_model(recorded().drive);
  estimation::PreparedData p = prepared(recorded().measured, m);
  const auto terms = estimation::terms_of(m);
  const auto floor_of_locked = [&] {
    RegressionProblem data(p, Balance::transmission);
    const auto floors = noise_floors(data, terms, pointers(recorded().measured), m.drive);
    for (std::size_t k = 0; k < floors.size(); ++k)
      if (p.records[data.records()[k].record].name == "locked") return floors[k];
    return NoiseFloor{};
  };
  const NoiseFloor before = floor_of_locked();
  ASSERT_EQ(before.from, "propagated");
  for (estimation::Record& r : p.records) r.torsion_zero_rad = r.inputs.torsion_zero = 1e-3;
  EXPECT_NEAR(*floor_of_locked().rmse, *before.rmse, 0.02 * *before.rmse);
}

TEST(NoiseFloor, GivesTheSameAnswerTwice) {
  const model::Model m = known_model(recorded().drive);
  const auto first = floors_of(recorded().measured, m, Balance::load),
             again = floors_of(recorded().measured, m, Balance::load);
  for (std::size_t k = 0; k < first.size(); ++k) EXPECT_EQ(*first[k].rmse, *again[k].rmse);
}

TEST(NoiseFloor, OfAllRecordsWeighsThemByTheirRowsAndIsNamedAfterTheWorstSource) {
  const std::vector<estimation::RowRange> ranges{{0, 0, 30}, {1, 30, 40}};
  const NoiseFloor both = pooled({{1.0, "periods"}, {3.0, "propagated"}}, ranges);
  EXPECT_DOUBLE_EQ(*both.rmse, std::sqrt((30.0 * 1.0 + 10.0 * 9.0) / 40.0));
  EXPECT_EQ(both.from, "propagated");
}

TEST(NoiseFloor, OfAllRecordsIsNotKnownWhereOneIsNot) {
  const std::vector<estimation::RowRange> ranges{{0, 0, 30}, {1, 30, 40}};
  const NoiseFloor both = pooled({{1.0, "periods"}, {}}, ranges);
  EXPECT_FALSE(both.rmse.has_value());
  EXPECT_EQ(both.from, "none");
}

TEST(NoiseFloor, OfTheMeasuredAxisIsItsPeriodToPeriodNoise) {
  const char* stated = std::getenv("FLEXSPLINE_DATA");
  const std::filesystem::path emps =
      (stated ? std::filesystem::path(stated)
              : std::filesystem::path(FLEXSPLINE_SOURCE_DIR) / ".." / "shared" / "data") /
      "emps";
  if (!std::filesystem::exists(emps / "emps_train.csv")) GTEST_SKIP() << "no EMPS data in " << emps;
  const data::TestFolder folder;
  folder.write("dataset.toml", fmt::format(R"(format = "flexspline-dataset/1"
[drive]
axis = "linear"
[columns.motor_torque_nm]
source = "motor_force_n"
unit = "N"
[columns.motor_position_rad]
source = "position_m"
unit = "m"
[[experiment]]
file = "{}/emps_train.csv"
name = "train"
)",
                                           std::filesystem::weakly_canonical(emps).string()));
  const data::Dataset dataset = data::load({folder.path()});
  model::Model m;
  m.drive.axis = data::Axis::linear;
  for (const char* name : {"inertia", "viscous_friction", "coulomb_friction", "torque_bias"})
    m.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::linear));
  estimation::PipelineOptions options;
  options.cutoff_hz = 100.0;
  const estimation::PreparedData p = estimation::prepare(pointers(dataset), m, options);
  RegressionProblem data(p, Balance::motor);
  estimation::Terms terms = estimation::terms_of(m);
  estimation::fit_balance(data, terms);
  const auto floors = noise_floors(data, terms, pointers(dataset), m.drive);
  ASSERT_EQ(floors.size(), 1u);
  EXPECT_EQ(floors[0].from, "periods");
  EXPECT_NEAR(*floors[0].rmse, 0.30, 0.03);  // N, measured by differences of the force itself
}

}  // namespace
}  // namespace flexspline::comparison::comparison_noise_floor_test
