// The pairs of effects that are known to be confused: data in which the diagnosis cannot distinguish, the motion that
// is planned to distinguish them, and what the diagnosis says with that motion recorded on the plant, which is written
// apart from the model that planned it.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "host/engine/planning/design.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::planning_test {
namespace {

// Seeds below 1100 were looked at while this was written.
std::uint64_t first_seed() {
  const char* tuning = std::getenv("FLEXSPLINE_SEED");
  return tuning ? std::strtoull(tuning, nullptr, 10) : 7001;
}

struct Pair {
  std::string first, second;
  double size_of_first = 1.0, size_of_second = 1.0;
  std::vector<plant::ExperimentPlan> recorded;  // motions in which they are confused
  bool separable = true;
};

struct PlannedCase {
  std::string truth;
  std::string before, after;                       // what is named, "-" for nothing
  double margin_before = 0.0, margin_after = 0.0;  // expected
  double won_before = 0.0, won_after = 0.0;        // score of the true effect less that of the other
  std::string motions;
  double plan_s = 0.0;
};

std::string named(const selection::Diagnosis& d) {
  std::string text;
  for (const selection::NamedEffect& n : d.named) text += (text.empty() ? "" : "+") + n.effect;
  return text.empty() ? "-" : text;
}

double won(const selection::Diagnosis& d, const std::string& truth, const std::string& other) {
  double score_of_truth = 0.0, score_of_other = 0.0;
  for (const selection::Candidate& c : d.candidates) {
    if (c.effect == truth) score_of_truth = std::max(score_of_truth, c.score);
    if (c.effect == other && c.admissible) score_of_other = std::max(score_of_other, c.score);
  }
  return score_of_truth - score_of_other;
}

std::vector<plant::ExperimentPlan> as_recorded(const planning::Plan& plan, plant::Drive& drive, std::uint64_t seed) {
  // By way of the file, as a person would.
  const auto file =
      std::filesystem::temp_directory_path() / fmt::format("flexspline-plan-{}-{}.toml", ::getpid(), seed);
  std::ofstream(file) << planning::text_of(plan);
  auto runs = plant::load_plan(file, drive);
  std::filesystem::remove(file);
  return runs;
}

PlannedCase plan_and_record(const Pair& pair, bool first_is_true, std::uint64_t seed) {
  PlannedCase result;
  result.truth = first_is_true ? pair.first : pair.second;
  plant::PlantFile demo = plant::demo_plant();
  for (const std::string& effect : {pair.first, pair.second}) plant::without(demo.drive, effect);
  plant::hide(demo.drive, result.truth, first_is_true ? pair.size_of_first : pair.size_of_second);
  data::Dataset dataset = tests::dataset_of(demo.drive, plant::record_all(demo.drive, pair.recorded, seed));
  const model::Model base = tests::model_of(demo.drive, false, false);
  const std::string& other = first_is_true ? pair.second : pair.first;
  const selection::Diagnosis before = selection::diagnose(dataset, base, {});
  result.before = named(before);
  result.won_before = won(before, result.truth, other);

  planning::PlanRequest request;
  request.model = &base;
  request.dataset = &dataset;
  request.setting = planning::setting_of(base, &dataset);
  // The drive gives more than its rated current for a while, and did so in these data.
  request.setting.limits.current_a = request.setting.locked_current_a = demo.drive.current_limit_a;
  request.setting.limits.load_torque_nm = 5.0;
  request.sensors = planning::sensors_of(base, &dataset);
  const planning::Design design = planning::discriminate(request, pair.first, pair.second);
  result.margin_before = design.before->worst();
  result.margin_after = design.after->worst();
  for (const planning::Run& run : design.plan.runs) {
    result.motions += (result.motions.empty() ? "" : ", ") + run.name;
    result.plan_s += run.duration_s;
  }
  const auto runs = as_recorded(design.plan, demo.drive, seed);
  if (runs.empty()) {
    result.after = result.before;
    result.won_after = result.won_before;
    return result;
  }
  for (const data::Experiment& e :
       tests::dataset_of(demo.drive, plant::record_all(demo.drive, runs, seed + 50)).experiments)
    dataset.experiments.push_back(e);
  const selection::Diagnosis after = selection::diagnose(dataset, base, {});
  result.after = named(after);
  result.won_after = won(after, result.truth, other);
  return result;
}

plant::ExperimentPlan motion(const std::string& name, plant::Mode mode, plant::Waveform waveform, double amplitude,
                             double frequency_hz) {
  plant::ExperimentPlan e;
  e.name = name;
  e.mode = mode;
  e.waveform = waveform;
  e.amplitude = amplitude;
  e.frequency_hz = frequency_hz;
  e.duration_s = 8.0;
  return e;
}
plant::ExperimentPlan velocity(plant::Waveform waveform, double amplitude, double frequency_hz, double temperature_c) {
  plant::ExperimentPlan e = motion(fmt::format("velocity-{:g}-{:g}-{:g}", amplitude, frequency_hz, temperature_c),
                                   plant::Mode::velocity, waveform, amplitude, frequency_hz);
  e.temperature_c = temperature_c;
  return e;
}
plant::ExperimentPlan locked(plant::Waveform waveform, double amplitude, double frequency_hz) {
  plant::ExperimentPlan e = motion(fmt::format("locked-{:g}-{:g}", amplitude, frequency_hz), plant::Mode::current,
                                   waveform, amplitude, frequency_hz);
  e.locked = true;
  return e;
}
using plant::Waveform;
const std::vector<Pair> kPairs = {
    {"stribeck_gaussian",
     "load_dependent_friction",
     0.1,
     0.2,
     {velocity(Waveform::sine, 100.0, 1.0, 30.0), locked(Waveform::square, 2.0, 0.25)}},
    {"load_dependent_friction",
     "torque_constant_saturation",
     0.08,
     0.04,
     {velocity(Waveform::sine, 60.0, 1.0, 30.0), locked(Waveform::sine, 3.0, 0.5)}},
    {"temperature_viscous",
     "temperature_coulomb",
     0.2,
     0.2,
     {velocity(Waveform::square, 60.0, 0.5, 24.0), velocity(Waveform::square, 60.0, 0.5, 42.0),
      velocity(Waveform::sine, 80.0, 1.0, 30.0)}},
    {"dahl_hysteresis",
     "structural_damping",
     0.08,
     0.3,
     {velocity(Waveform::sine, 60.0, 1.0, 30.0), locked(Waveform::sine, 3.0, 0.5)}},
    {"backlash",
     "cubic_stiffness",
     0.035,
     0.06,
     {velocity(Waveform::sine, 60.0, 1.0, 30.0), locked(Waveform::sine, 3.0, 0.5)}},
    {"current_offset",
     "coulomb_asymmetry",
     0.3,
     0.3,
     {velocity(Waveform::sine, 60.0, 1.0, 30.0), velocity(Waveform::sine, 100.0, 0.5, 30.0)}},
    {"cubic_stiffness",
     "quadratic_stiffness",
     0.03,
     0.02,
     {velocity(Waveform::sine, 60.0, 1.0, 30.0), locked(Waveform::sine, 3.0, 0.5)},
     false},
};

TEST(Planning, TheMotionPlannedForTwoEffectsDistinguishesThem) {
  struct Case {
    const Pair* pair;
    bool first;
  };
  std::vector<Case> cases;
  for (std::size_t i = 0; i < kPairs.size(); ++i)
    for (const bool first : {true, false}) {
      // Every second pair, and one of the two by turns; in the whole campaign all.
      if ((i % 2 == 0 && first == (i % 4 == 0)) || tests::whole_campaigns()) cases.push_back({&kPairs[i], first});
    }
  std::vector<PlannedCase> all(cases.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++)
      all[i] = plan_and_record(*cases[i].pair, cases[i].first, first_seed());
  };
  std::thread other(work);
  work();
  other.join();
  int right = 0, possible = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const PlannedCase& t = all[i];
    fmt::print(
        "{:26} / {:26} truth {:26} named {} (wins by {:.1f}, expected {:.3g}) -> {} (wins by {:.1f}, expected {:.3g}) "
        "with {:.0f} s: {}\n",
        cases[i].pair->first, cases[i].pair->second, t.truth, t.before, t.won_before, t.margin_before, t.after,
        t.won_after, t.margin_after, t.plan_s, t.motions);
    // Where nothing separates two effects the plan is empty and says so; it never promises what does not come.
    EXPECT_EQ(t.motions.empty(), t.margin_after < planning::kDistinguished || t.margin_after == t.margin_before);
    if (!cases[i].pair->separable) continue;
    ++possible;
    right += t.won_after > 10.0;
  }
  fmt::print("{} of {} named right with the planned motion\n", right, possible);
  EXPECT_GE(right, 0.85 * possible);
}

}  // namespace
}  // namespace flexspline::planning_test
