// Drives with one effect that the model does not know, and drives with none: what the diagnosis names, and what adding
// it does to the error on motions that the fit never saw.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <thread>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/campaign_statistics.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::hidden_effects_test {
namespace {

using tests::in_campaign;
using tests::part_of;

struct Case {
  std::string hidden;  // empty: nothing is
  double scale = 1.0;
  std::uint64_t seed = 0;
  std::string with;                 // further effects that the drive has and the model knows
  double friction_variation = 0.0;  // relative, from record to record
  double noise_correlation = 0.0;   // AR(1) coefficient
};

struct Outcome {
  Case what;
  std::string named;  // "+" between effects that could not be distinguished, "-" for none
  bool right = false;
  double holdout_over_floor = 0.0;
  double before_over_floor = 0.0;
  std::string verdict;
  std::string detail;
};

std::string label(const std::string& effect, const std::optional<double>& order) {
  return order ? fmt::format("{}:{:g}", effect, *order) : effect;
}

Outcome run(const Case& c) {
  Outcome outcome{c, "", false, 0.0, 0.0, "", ""};
  plant::PlantFile demo = plant::demo_plant();
  if (!c.hidden.empty()) plant::hide(demo.drive, c.hidden, c.scale);
  for (const std::string_view name : catalogue::split_names(c.with))
    if (name != c.hidden) plant::with(demo.drive, name);
  demo.drive.friction_variation = c.friction_variation;
  demo.drive.sensors.current.correlation = c.noise_correlation;
  demo.drive.sensors.torque.correlation = c.noise_correlation;
  const auto records = plant::record_all(demo.drive, demo.experiments, c.seed);
  const data::Dataset dataset = tests::dataset_of(demo.drive, records);
  const model::Model base = tests::model_of(demo.drive, false, false);
  const selection::Diagnosis d = selection::diagnose(dataset, base, {});
  outcome.verdict = selection::verdict_name(d.verdict);
  for (const auto& n : d.named) outcome.named += (outcome.named.empty() ? "" : "+") + label(n.effect, n.order);
  if (d.named.empty()) outcome.named = "-";
  for (std::size_t i = 0; i < std::min<std::size_t>(4, d.candidates.size()); ++i)
    outcome.detail += fmt::format(" {}({:.0f},{:.2f}%{})", label(d.candidates[i].effect, d.candidates[i].order),
                                  d.candidates[i].score, d.candidates[i].chi2_decrease_percent,
                                  d.candidates[i].admissible ? "" : ",x");
  if (c.hidden.empty()) {
    outcome.right = d.named.empty() && !d.unknown && d.verdict != selection::Verdict::unknown_structure;
    return outcome;
  }
  const std::string truth = c.hidden == "torque_ripple" ? "torque_ripple:2" : c.hidden;
  outcome.right = outcome.named == truth;
  // The floor: the residual of the true model with its true parameters, through the same pipeline.
  const selection::Addition added = selection::add(dataset, base, truth, {});
  const model::Model true_model = tests::model_of(demo.drive, true, true);
  std::vector<const data::Experiment*> fit, holdout;
  for (const auto& e : dataset.experiments) (e.role == data::Role::holdout ? holdout : fit).push_back(&e);
  const estimation::PreparedData prepared = estimation::prepare(fit, true_model, {});
  const estimation::PreparedData held_out = estimation::prepare_with(holdout, true_model.drive, prepared.pipeline);
  estimation::RegressionProblem data(held_out, catalogue::get(truth.substr(0, truth.find(':'))).info->balance);
  const Eigen::VectorXd r = data.residual(estimation::terms_of(true_model));
  const double floor = std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
  outcome.holdout_over_floor = *added.after.rmse_holdout / floor;
  outcome.before_over_floor = *added.before.rmse_holdout / floor;
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
  return outcomes;
}

const std::vector<std::string> kHidden = {
    "viscous_asymmetry", "coulomb_asymmetry", "stribeck_gaussian", "load_dependent_friction", "power_law_friction",
    "gravity",           "current_offset",    "torque_ripple:2",   "torque_ripple:7",         "temperature_viscous",
    "dahl_friction",     "backlash",          "structural_damping"};

void print(const std::vector<Outcome>& outcomes) {
  std::map<std::string, std::map<std::string, int>> confusion;
  for (const Outcome& o : outcomes) {
    const std::string row = o.what.hidden.empty() ? "(nothing)" : fmt::format("{} x {:g}", o.what.hidden, o.what.scale);
    ++confusion[row][o.named];
    fmt::print("{:28} seed {:3} {} {:30} hold-out {:.3f} -> {:.3f} of floor |{}\n", row, o.what.seed,
               o.right ? "right" : "WRONG", o.named, o.before_over_floor, o.holdout_over_floor, o.detail);
  }
  fmt::print("\nhidden                        named\n");
  for (const auto& [row, columns] : confusion) {
    fmt::print("{:28} ", row);
    for (const auto& [name, count] : columns) fmt::print(" {} x{}", name, count);
    fmt::print("\n");
  }
}

// Seeds below 1000 were used while the diagnosis was written; these test it.
constexpr std::uint64_t kFirstSeed = 7001;

std::vector<Case> cases_at(const std::vector<std::string>& effects, double scale, std::uint64_t seeds,
                           const std::string& with = {}, double friction_variation = 0.0) {
  std::vector<Case> cases;
  for (const std::string& hidden : effects)
    for (std::uint64_t s = 0; s < seeds; ++s)
      cases.push_back({hidden, scale, kFirstSeed + 100 * s, with, friction_variation, 0.0});
  return cases;
}

TEST(HiddenEffects, AreNamedAtUsualSizeAndAddingThemReachesTheFloor) {
  const auto outcomes = run_all(cases_at(part_of(kHidden, 12, 0), 1.0, in_campaign(1, 2)));
  print(outcomes);
  for (const Outcome& o : outcomes) {
    EXPECT_TRUE(o.right) << o.what.hidden << " seed " << o.what.seed << ": named " << o.named << ";" << o.detail;
    EXPECT_LE(o.holdout_over_floor, 1.1) << o.what.hidden << " seed " << o.what.seed;
  }
}

TEST(HiddenEffects, AreNamedOnADriveThatHasMostOtherEffectsToo) {
  const auto outcomes =
      run_all(cases_at(part_of(kHidden, 12, 7), 1.0, 1,
                       "stribeck_gaussian,load_dependent_friction,gravity,torque_ripple:2,temperature_viscous"));
  print(outcomes);
  for (const Outcome& o : outcomes) {
    EXPECT_TRUE(o.right) << o.what.hidden << ": named " << o.named << ";" << o.detail;
    EXPECT_LE(o.holdout_over_floor, 1.1) << o.what.hidden;
  }
}

TEST(HiddenEffects, AreNamedAtAFifthOfTheirSizeInNineOfTenDrives) {
  const auto outcomes = run_all(cases_at(part_of(kHidden, 12, 2), 0.2, in_campaign(1, 3)));
  print(outcomes);
  const auto right = std::count_if(outcomes.begin(), outcomes.end(), [](const Outcome& o) { return o.right; });
  EXPECT_GE(right, static_cast<std::ptrdiff_t>(std::ceil(0.9 * static_cast<double>(outcomes.size()))));
}

TEST(HiddenEffects, AreNamedWhereFrictionDiffersFromRunToRun) {
  const auto outcomes = run_all(cases_at(part_of(kHidden, 12, 9), 1.0, 1, "", 0.03));
  print(outcomes);
  // The hold-out records have their own friction, so that their error says nothing of the effect that was added.
  for (const Outcome& o : outcomes) EXPECT_TRUE(o.right) << o.what.hidden << ": named " << o.named << ";" << o.detail;
}

// `drives` sets with nothing hidden, of which neither a name nor an unknown structure may be stated. Prints the false
// names with the exact interval of their rate; returns their count.
std::ptrdiff_t false_names(std::uint64_t first_seed, std::uint64_t drives, double friction_variation,
                           double noise_correlation) {
  std::vector<Case> cases;
  for (std::uint64_t s = 0; s < drives; ++s)
    cases.push_back({"", 1.0, first_seed + s, "", friction_variation, noise_correlation});
  const auto outcomes = run_all(cases);
  print(outcomes);
  const auto wrong = std::count_if(outcomes.begin(), outcomes.end(), [](const Outcome& o) { return !o.right; });
  const tests::Interval rate = tests::exact_interval(static_cast<std::size_t>(wrong), outcomes.size());
  fmt::print("false names: {} of {}; 95 % interval of the rate {:.2f} to {:.2f} %\n", wrong, outcomes.size(),
             100.0 * rate.low, 100.0 * rate.high);
  return wrong;
}

// Of five drives none may have a false name: with a rate of 5 % that holds for 77 % of all such choices of seeds, with
// one of 37 % for a tenth. The rate itself, 1 of 20, is held by the whole campaign.
TEST(HiddenEffects, NothingIsNamedWhereNothingIsHidden) {
  EXPECT_LE(false_names(kFirstSeed + 1000, in_campaign(2, 20), 0.0, 0.0), in_campaign(0, 1));
}

TEST(HiddenEffects, NothingIsNamedWhereOnlyFrictionDiffersFromRunToRun) {
  EXPECT_LE(false_names(kFirstSeed + 2000, in_campaign(1, 12), 0.03, 0.0), in_campaign(0, 1));
}

TEST(HiddenEffects, NothingIsNamedInColouredNoise) {
  EXPECT_LE(false_names(kFirstSeed + 3000, in_campaign(1, 12), 0.0, 0.9), in_campaign(0, 1));
  EXPECT_LE(false_names(kFirstSeed + 4000, in_campaign(1, 12), 0.03, 0.9), in_campaign(0, 1));
}

}  // namespace
}  // namespace flexspline::hidden_effects_test
