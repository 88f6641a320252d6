// The smallest effect that the diagnosis says it would have shown, against drives that have it half as large again, and
// against drives that have a third of it.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::detectable_test {
namespace {

// Seeds below 1100 were looked at while this was written.
std::uint64_t first_seed() {
  const char* tuning = std::getenv("FLEXSPLINE_SEED");
  return tuning ? std::strtoull(tuning, nullptr, 10) : 7001;
}

selection::Diagnosis diagnosed(const plant::PlantFile& demo, std::uint64_t seed) {
  const data::Dataset dataset = tests::dataset_of(demo.drive, plant::record_all(demo.drive, demo.experiments, seed));
  return selection::diagnose(dataset, tests::model_of(demo.drive, false, false), {});
}

const selection::Candidate* candidate(const selection::Diagnosis& d, const std::string& effect) {
  for (const selection::Candidate& c : d.candidates)
    if (c.effect == effect && c.minimum_detectable) return &c;
  return nullptr;
}

// What the plant's parameters are to be multiplied by so that the effect has this size.
double scale_to(const plant::Drive& drive, const std::string& label, const selection::Detectable& wanted,
                double times) {
  for (const plant::Effect& e : drive.effects)
    if (e.label() == label) {
      const double usual = wanted.size.parameter == "amplitude" ? std::hypot(e.value("cosine"), e.value("sine"))
                                                                : e.value(wanted.size.parameter);
      return times * wanted.size.value / std::abs(usual);
    }
  return 0.0;
}

struct Shown {
  int large = 0, small = 0, seeds = 0;
  std::string text;
};

bool has(const plant::PlantFile& demo, const std::string& label) {
  return std::any_of(demo.drive.effects.begin(), demo.drive.effects.end(),
                     [&](const plant::Effect& e) { return e.present && e.label() == label; });
}

// `demos`: the diagnosis of the demo's drive, which says the smallest size of each effect that this drive has not.
Shown shown(const std::string& label, const selection::Diagnosis& demos, std::uint64_t seed, int seeds) {
  const std::string type = label.substr(0, label.find(':'));
  plant::PlantFile without = plant::demo_plant();
  const bool is_there = has(without, label);
  plant::without(without.drive, label);
  const selection::Diagnosis clean = is_there ? diagnosed(without, seed) : demos;
  const selection::Candidate* c = candidate(clean, type);
  Shown result;
  if (!c) return result;
  const selection::Detectable& least = *c->minimum_detectable;
  result.text = fmt::format("{} {:.4g} {}", least.size.parameter, least.size.value, least.size.unit);
  for (int s = 0; s < seeds; ++s)
    for (const double times : {1.5, 1.0 / 3.0}) {
      plant::PlantFile hidden = plant::demo_plant();
      for (plant::Effect& e : hidden.drive.effects)
        if (e.label() == label)
          for (const estimation::Estimate& shape : least.at) e.parameter(shape.parameter).value = shape.value;
      plant::hide(hidden.drive, label, scale_to(hidden.drive, label, least, times));
      const selection::Diagnosis d = diagnosed(hidden, seed + 1 + static_cast<std::uint64_t>(s));
      bool named = false;
      // Near the limit the data may not distinguish it from what it is known to be confused with.
      for (const selection::NamedEffect& n : d.named)
        named =
            named || n.effect == type || catalogue::names_contain(catalogue::get(type).info->confused_with, n.effect);
      (times > 1.0 ? result.large : result.small) += named;
      result.text += fmt::format(" | {:.2f}: {}", times, d.named.empty() ? "-" : d.named.front().effect);
    }
  result.seeds = seeds;
  return result;
}

// Effects of temperature are not tested: between records they look like friction that differs from run to run, which
// takes them up, and the size that is said for them does not count with that (host/engine/selection/METHOD.md).
TEST(Detectable, EffectsHalfAsLargeAgainAreNamedAndAThirdOfThemAreNot) {
  std::vector<std::string> labels =
      tests::part_of({"viscous_asymmetry", "coulomb_asymmetry", "stribeck_gaussian", "load_dependent_friction",
                      "power_law_friction", "gravity", "current_offset", "torque_ripple:2",
                      "torque_constant_saturation", "cubic_stiffness", "backlash", "quadratic_drag"},
                     4, 2);
  if (!tests::whole_campaigns()) labels.resize(2);
  constexpr int kSeeds = 1;
  const selection::Diagnosis demos = diagnosed(plant::demo_plant(), first_seed());
  std::vector<Shown> all(labels.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < labels.size(); i = next++)
      all[i] = shown(labels[i], demos, first_seed() + 20 * i, kSeeds);
  };
  std::thread other(work);
  work();
  other.join();
  int large = 0, small = 0, seeds = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    fmt::print("{:28} {}/{} at 1.5, {}/{} at a third: {}\n", labels[i], all[i].large, all[i].seeds, all[i].small,
               all[i].seeds, all[i].text);
    EXPECT_GT(all[i].seeds, 0) << labels[i] << " has no smallest size";
    large += all[i].large;
    small += all[i].small;
    seeds += all[i].seeds;
  }
  EXPECT_GE(large, 0.8 * seeds);
  EXPECT_LE(small, 0.1 * seeds);
}

}  // namespace
}  // namespace flexspline::detectable_test
