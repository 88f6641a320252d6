// Drives with an effect that no library has: whether the diagnosis says so, over which signal, and what a curve over it
// does to the error on motions that the fit never saw.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>
#include <thread>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::unknown_effects_test {
namespace {

struct Truth {
  std::string hidden;  // empty: nothing is
  double scale = 1.0;
  // Effects of the catalogue that are the nearest there: naming one of them alone is no mistake where it leaves little.
  std::set<std::string> nearest;
  std::set<std::string> curves;  // signals that show it
};

struct Case {
  Truth truth;
  std::uint64_t seed = 0;
};

struct Outcome {
  Case what;
  std::string verdict, named, curve;
  double before = 0.0, after = 0.0;  // held-out error over the floor, without and with the curve
  bool flagged = false, of_its_class = false, right_signal = false;
};

// The drive's own residual with all that the library knows of the truth, and the hidden effect in full: what is left is
// noise. The noise of the torque balance does not depend on what is hidden, so the floor is that of a drive that hides
// nothing, on the same motions with the same noise.
double floor_of(const plant::PlantFile& demo, std::uint64_t seed) {
  plant::PlantFile plain = demo;
  const data::Dataset dataset = tests::dataset_of(plain.drive, plant::record_all(plain.drive, plain.experiments, seed));
  const model::Model truth = tests::model_of(plain.drive, true, true);
  std::vector<const data::Experiment*> fit, holdout;
  for (const auto& e : dataset.experiments) (e.role == data::Role::holdout ? holdout : fit).push_back(&e);
  const estimation::PreparedData prepared = estimation::prepare(fit, truth, {});
  const estimation::PreparedData held_out = estimation::prepare_with(holdout, truth.drive, prepared.pipeline);
  estimation::RegressionProblem data(held_out, estimation::Balance::motor);
  const Eigen::VectorXd r = data.residual(estimation::terms_of(truth));
  return std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
}

Outcome run(const Case& c) {
  Outcome outcome;
  outcome.what = c;
  plant::PlantFile demo = plant::demo_plant();
  if (!c.truth.hidden.empty()) plant::hide(demo.drive, c.truth.hidden, c.truth.scale);
  const data::Dataset dataset = tests::dataset_of(demo.drive, plant::record_all(demo.drive, demo.experiments, c.seed));
  const model::Model base = tests::model_of(demo.drive, false, false);
  const selection::Diagnosis d = selection::diagnose(dataset, base, {});
  outcome.verdict = selection::verdict_name(d.verdict);
  bool of_class = !d.named.empty();
  for (const auto& n : d.named) {
    outcome.named += (outcome.named.empty() ? "" : "+") + n.effect;
    of_class = of_class && c.truth.nearest.contains(n.effect);
  }
  outcome.flagged = d.verdict == selection::Verdict::unknown_structure;
  outcome.of_its_class = of_class;
  if (d.unknown) {
    outcome.curve = d.unknown->effect;
    outcome.right_signal = c.truth.curves.contains(d.unknown->effect.substr(d.unknown->effect.find(':') + 1));
    selection::UserDefinition made;
    made.balance = d.unknown->definition.balance;
    const selection::Addition added = selection::add(dataset, base, d.unknown->effect, {}, made);
    const double floor = floor_of(plant::demo_plant(), c.seed);
    outcome.before = *added.before.rmse_holdout / floor;
    outcome.after = *added.after.rmse_holdout / floor;
  }
  return outcome;
}

std::vector<Outcome> run_all(const std::vector<Case>& cases) {
  std::vector<Outcome> outcomes(cases.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++) outcomes[i] = run(cases[i]);
  };
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < std::max(1u, std::thread::hardware_concurrency()); ++t) threads.emplace_back(work);
  for (std::thread& t : threads) t.join();
  for (const Outcome& o : outcomes)
    fmt::print("{:20} x {:4g} seed {:5} {:20} {:30} {:40} hold-out {:.3f} -> {:.3f} of floor\n",
               o.what.truth.hidden.empty() ? "(nothing)" : o.what.truth.hidden, o.what.truth.scale, o.what.seed,
               o.verdict, o.named.empty() ? "-" : o.named, o.curve.empty() ? "-" : o.curve, o.before, o.after);
  return outcomes;
}

std::vector<Truth> truths(double scale) {
  return {
      {"stribeck_exponent",
       scale,
       {"stribeck_gaussian", "stribeck_hess_soom", "power_law_friction"},
       {"velocity", "velocity*direction", "speed*direction"}},
      {"load_power_friction", scale, {"load_dependent_friction"}, {"torque*direction", "torque_magnitude*direction"}},
      {"triangle_ripple", scale, {"torque_ripple"}, {"motor_angle"}},
      {"damaged_tooth", scale, {}, {"motor_angle*direction"}},
      {"tight_spot", scale, {}, {"output_angle*direction"}},
      {"speed_onset",
       scale,
       {"quadratic_drag", "power_law_friction"},
       {"velocity", "speed*direction", "velocity*direction"}},
  };
}

// Seeds from 7001 on test; limits were set on seeds below 1100.
TEST(UnknownEffects, AreFlaggedOrGivenTheNameOfTheirClassAndTheirCurveTakesTheErrorToTheFloor) {
  std::vector<Case> cases;
  const std::uint64_t seeds = tests::in_campaign(1, 2);
  for (std::uint64_t seed = 7001; seed < 7001 + seeds; ++seed)
    for (const Truth& t : truths(1.0)) {
      // Three have a relative in the catalogue, whose name is given: one of them, in the whole campaign all.
      const bool is_another = t.hidden == "load_power_friction" || t.hidden == "triangle_ripple";
      if (!is_another || tests::whole_campaigns()) cases.push_back({t, seed});
    }
  const std::vector<Outcome> outcomes = run_all(cases);
  int found = 0, flagged = 0, right_signal = 0;
  std::vector<double> after;
  for (const Outcome& o : outcomes) {
    found += o.flagged || o.of_its_class ? 1 : 0;
    if (!o.flagged) continue;
    ++flagged;
    right_signal += o.right_signal ? 1 : 0;
    after.push_back(o.after);
    EXPECT_LT(o.after, 0.2 * o.before) << o.what.truth.hidden;
  }
  const auto all = static_cast<int>(outcomes.size());
  fmt::print("found {} of {}; flagged {}, with the right signal {}\n", found, all, flagged, right_signal);
  EXPECT_GE(found, static_cast<int>(std::ceil(0.9 * all)));
  ASSERT_GE(flagged, 3 * static_cast<int>(seeds)) << "three of the truths have no relative in the catalogue";
  EXPECT_GE(right_signal, static_cast<int>(std::ceil(0.9 * flagged)));
  std::sort(after.begin(), after.end());
  fmt::print("held-out error with the curve over the floor: median {:.3f}, largest {:.3f}\n", after[after.size() / 2],
             after.back());
  EXPECT_LT(after[after.size() / 2], 1.15);
  EXPECT_LT(after.back(), 1.6);
}

// Where nothing is missing, hidden_effects_test.cpp expects that none is seen.

// Seeds to tune on, for whoever changes a limit: FLEXSPLINE_TUNE=1 runs these alone.
TEST(UnknownEffects, TuningSeeds) {
  if (std::getenv("FLEXSPLINE_TUNE") == nullptr) GTEST_SKIP() << "set FLEXSPLINE_TUNE to see the tuning seeds";
  std::vector<Case> cases;
  const int seeds = std::atoi(std::getenv("FLEXSPLINE_TUNE"));
  const char* only = std::getenv("FLEXSPLINE_ONLY");
  for (int s = 1; s <= seeds; ++s) {
    for (const double scale : {1.0, 0.5})
      for (const Truth& t : truths(scale))
        if (only == nullptr || t.hidden == only) cases.push_back({t, static_cast<std::uint64_t>(900 + s)});
    if (only == nullptr) cases.push_back({{}, static_cast<std::uint64_t>(900 + s)});
  }
  run_all(cases);
}

}  // namespace
}  // namespace flexspline::unknown_effects_test
