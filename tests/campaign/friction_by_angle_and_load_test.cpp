// Friction that varies with the angle or with the load, hidden in a drive that moves so that it shows: the diagnosis
// names it, and the model with it is at the floor on motions that the fit never saw.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::friction_by_angle_and_load_test {
namespace {

using Experiments = std::vector<plant::ExperimentPlan>;

struct Outcome {
  std::string named, detail;
  double before = 0.0, after = 0.0;  // held-out error over that of the true model with its true values
};

double held_out_floor(const data::Dataset& dataset, const model::Model& truth) {
  std::vector<const data::Experiment*> fit, holdout;
  for (const auto& e : dataset.experiments) (e.role == data::Role::holdout ? holdout : fit).push_back(&e);
  const estimation::PreparedData prepared = estimation::prepare(fit, truth, {});
  const estimation::PreparedData held_out = estimation::prepare_with(holdout, truth.drive, prepared.pipeline);
  estimation::RegressionProblem data(held_out, estimation::Balance::motor);
  const Eigen::VectorXd r = data.residual(estimation::terms_of(truth));
  return std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
}

// `adds`: whether before and after are wanted, too.
Outcome diagnose(const std::string& hidden, const Experiments& experiments, double arm_nm, std::uint64_t seed,
                 bool adds = true) {
  plant::Drive drive = plant::demo_plant().drive;
  if (arm_nm > 0.0) {
    plant::with(drive, "gravity");
    for (plant::Effect& e : drive.effects)
      if (e.type == "gravity") e.parameter("sine").value = arm_nm;
  }
  plant::hide(drive, hidden);
  const data::Dataset dataset = tests::dataset_of(drive, plant::record_all(drive, experiments, seed));
  const model::Model base = tests::model_of(drive, false, false);
  Outcome outcome;
  const selection::Diagnosis d = selection::diagnose(dataset, base, {});
  for (const auto& n : d.named)
    outcome.named += (outcome.named.empty() ? "" : "+") + n.effect + (n.order ? fmt::format(":{:g}", *n.order) : "");
  for (std::size_t i = 0; i < std::min<std::size_t>(5, d.candidates.size()); ++i)
    outcome.detail += fmt::format(" {}({:.0f},{:.2f}%{})", d.candidates[i].effect, d.candidates[i].score,
                                  d.candidates[i].chi2_decrease_percent, d.candidates[i].admissible ? "" : ",x");
  if (!adds) return outcome;
  const double floor = held_out_floor(dataset, tests::model_of(drive, true, true));
  const selection::Addition added = selection::add(dataset, base, drive.hidden(), {});
  outcome.before = *added.before.rmse_holdout / floor;
  outcome.after = *added.after.rmse_holdout / floor;
  fmt::print("{:30} seed {} named {:40} hold-out {:.3f} -> {:.3f} of floor |{}\n", hidden, seed, outcome.named,
             outcome.before, outcome.after, outcome.detail);
  for (const auto& e : added.estimates)
    if (hidden.starts_with(e.effect)) fmt::print("  {} {:.5g} +- {:.2g}\n", e.parameter, e.value, e.std.value_or(0.0));
  return outcome;
}

// The demo's motions, and an arm of 20 N m that swings slowly and less slowly: the motor lifts it and is driven by it.
Experiments with_swings() {
  Experiments experiments = plant::demo_plant().experiments;
  const auto swing = [&](double amplitude, double frequency_hz, bool holdout) {
    plant::ExperimentPlan e;
    e.name = fmt::format("{}-{:g}-rad-s", holdout ? "holdout-swing" : "swing", amplitude);
    e.mode = plant::Mode::velocity;
    e.waveform = plant::Waveform::triangle;
    e.amplitude = amplitude;
    e.frequency_hz = frequency_hz;
    e.duration_s = 20.0;
    e.holdout = holdout;
    experiments.push_back(e);
  };
  swing(30.0, 0.05, false);
  swing(60.0, 0.1, false);
  swing(120.0, 0.2, false);
  swing(45.0, 0.08, true);
  return experiments;
}
constexpr double kArmNm = 20.0;

TEST(FrictionByAngle, IsNamedWithItsOrder) {
  const Experiments experiments = plant::demo_plant().experiments;
  for (std::uint64_t seed = 7001; seed <= tests::in_campaign<std::uint64_t>(7001, 7002); ++seed) {
    const Outcome o = diagnose("angle_dependent_friction:2", experiments, 0.0, seed);
    EXPECT_EQ(o.named, "angle_dependent_friction:2");
    EXPECT_GT(o.before, 1.3);
    EXPECT_LT(o.after, 1.05);
  }
}

// What BAM's models M3 and M4 and measured gears have: a law for each load, and one that falls with speed as well.
TEST(FrictionByLoad, StictionThatGrowsWithTheLoadIsNamed) {
  for (std::uint64_t seed = 7001; seed <= tests::in_campaign<std::uint64_t>(7001, 7002); ++seed) {
    const Outcome o = diagnose("load_dependent_stiction", with_swings(), kArmNm, seed);
    EXPECT_EQ(o.named, "load_dependent_stiction");
    EXPECT_GT(o.before, 1.3);
    EXPECT_LT(o.after, 1.05);
  }
}

TEST(FrictionByLoad, LossThatDiffersBetweenDrivingAndDrivenIsNamed) {
  for (std::uint64_t seed = 7001; seed <= tests::in_campaign<std::uint64_t>(7001, 7002); ++seed) {
    const Outcome o = diagnose("driving_dependent_loss", with_swings(), kArmNm, seed);
    EXPECT_EQ(o.named, "driving_dependent_loss");
    EXPECT_GT(o.before, 1.3);
    EXPECT_LT(o.after, 1.05);
  }
}

// Friction that grows with the load alone is not taken for one of the two.
TEST(FrictionByLoad, FrictionInProportionToTheLoadKeepsItsName) {
  const Outcome o = diagnose("load_dependent_friction", with_swings(), kArmNm, 7001, false);
  EXPECT_EQ(o.named, "load_dependent_friction");
}

}  // namespace
}  // namespace flexspline::friction_by_angle_and_load_test
