// Whether standard intervals hold what they promise where friction differs from record to record, and where it does
// not.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/selection/add.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::intervals_test {
namespace {

struct Coverage {
  int inside = 0, all = 0;
  double width = 0.0;  // of the intervals, relative, summed
  double share() const { return static_cast<double>(inside) / std::max(1, all); }
};

std::map<std::string, double> truth_of(const model::Model& model) {
  std::map<std::string, double> truth;
  for (const model::Effect& e : model.effects)
    for (const model::Parameter& p : e.parameters)
      if (p.value) truth[e.type + "." + p.name] = *p.value;
  return truth;
}

// By parameter, of drives whose model is complete. `added`: an effect that is not in the model and comes by `add`.
std::map<std::string, Coverage> over_seeds(double friction_variation, const std::string& added, std::size_t seeds) {
  std::vector<std::vector<estimation::Estimate>> found(seeds);
  std::map<std::string, double> truth;
  plant::PlantFile demo = plant::demo_plant();
  demo.drive.friction_variation = friction_variation;
  if (!added.empty()) plant::hide(demo.drive, added, 1.0);
  std::erase_if(demo.experiments, [](const plant::ExperimentPlan& e) { return e.holdout; });
  for (plant::ExperimentPlan& e : demo.experiments) e.duration_s = 6.0;
  truth = truth_of(tests::model_of(demo.drive, true, true));
  estimation::in_parallel(seeds, [&](std::size_t s) {
    const auto records = plant::record_all(demo.drive, demo.experiments, 7001 + s);
    const data::Dataset dataset = tests::dataset_of(demo.drive, records);
    const model::Model model = tests::model_of(demo.drive, false, false);
    found[s] = added.empty() ? estimation::identify(dataset, model, {})->estimates
                             : selection::add(dataset, model, added, {}).estimates;
  });
  std::map<std::string, Coverage> coverage;
  for (const auto& estimates : found)
    for (const estimation::Estimate& e : estimates) {
      const std::string name = e.effect + "." + e.parameter;
      if (!e.low || !e.high || !truth.contains(name)) continue;
      Coverage& c = coverage[name];
      c.inside += *e.low <= truth[name] && truth[name] <= *e.high;
      c.width += (*e.high - *e.low) / std::abs(truth[name]);
      ++c.all;
    }
  for (const auto& [name, c] : coverage)
    std::printf("%4.1f %% %-34s covered %5.1f %% of %d, mean width %.3f %%\n", 100.0 * friction_variation, name.c_str(),
                100.0 * c.share(), c.all, 100.0 * c.width / c.all);
  return coverage;
}

double together(const std::map<std::string, Coverage>& coverage, const std::vector<std::string>& names) {
  Coverage sum;
  for (const std::string& name : names) {
    sum.inside += coverage.at(name).inside;
    sum.all += coverage.at(name).all;
  }
  return sum.share();
}

const std::vector<std::string> kFriction = {"viscous_friction.coefficient", "coulomb_friction.torque"};

TEST(Intervals, HoldTheMeanFrictionWhereItDiffersFromRecordToRecord) {
  const auto coverage = over_seeds(0.03, "", 50);
  const double share = together(coverage, kFriction);
  EXPECT_GE(share, 0.90);
  EXPECT_LE(share, 0.98);
}

const std::vector<std::string> kLoad = {"output_inertia.inertia", "output_viscous_friction.coefficient",
                                        "output_coulomb_friction.torque"};

// Twenty short sets determine a coverage to 7 % only; what matters is the width: that of noise compared with what
// identify adds to each estimate for what filters leave (0.05 % of it). The load's come from a torque sensor that is
// read just before the held current steps (host/engine/estimation/zero_order_hold.hpp).
TEST(Intervals, AreHardlyWiderWhereFrictionIsTheSameInAllRecords) {
  constexpr double kBeyondNoise = 2.0 * 1.96 * 5e-4, kOfNoise = 0.0015;
  const auto coverage = over_seeds(0.0, "", 20);
  EXPECT_GE(together(coverage, kFriction), 0.90);
  EXPECT_GE(together(coverage, kLoad), 0.80);
  for (const std::string& name : kFriction)
    EXPECT_LT(coverage.at(name).width / coverage.at(name).all, std::hypot(kBeyondNoise, kOfNoise)) << name;
}

TEST(Intervals, OfAnAddedEffectHoldWhereFrictionDiffersToo) {
  // At most 3 of 24 intervals outside, in the whole campaign 5 of 48: of intervals that hold the truth with 95 % more
  // are outside in 3 % of all such runs.
  const auto sets = tests::in_campaign<std::size_t>(12, 24);
  const double least = tests::in_campaign(0.87, 0.88);
  const auto coverage = over_seeds(0.03, "stribeck_gaussian", sets);
  EXPECT_GE(together(coverage, kFriction), least);
  EXPECT_GE(together(coverage, {"stribeck_gaussian.amplitude_positive", "stribeck_gaussian.amplitude_negative"}),
            least);
}

}  // namespace
}  // namespace flexspline::intervals_test
