// Whether the 95 % intervals of a complete model hold the truth, for every effect of the catalogue that the plant has,
// in four worlds: the demo's, friction that differs from record to record, noise that is correlated, coarse encoders.
// Sizes are drawn. Seeds below 5000 were used while intervals were made; these are others.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <string>
#include <vector>

#include "host/engine/selection/add.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/interval_coverage.hpp"

namespace flexspline::tests::catalogue_intervals_test {
namespace {

constexpr std::uint64_t kFirstSeed = 9001;

std::vector<estimation::Estimate> identified(const data::Dataset& dataset, const model::Model& model) {
  estimation::Options options;
  options.starts = 1;
  return estimation::estimate(dataset, model, {}, options)->estimates;
}

// All that the plant and the catalogue have beyond the demo's own effects; first the demo as it is.
std::vector<std::string> all_labels() {
  std::vector<std::string> labels{""};
  for (const plant::Effect& e : plant::demo_plant().drive.effects)
    if (e.catalogue && !e.present) labels.push_back(e.label());
  return labels;
}

struct Share {
  std::size_t inside = 0, all = 0;
};
Share of_effect(const Coverage& coverage, const std::string& effect) {
  Share share;
  for (const auto& [name, c] : coverage)
    if (effect.empty() || name.starts_with(effect + ".")) {
      share.inside += c.inside;
      share.all += c.all;
    }
  return share;
}

std::string type_of(const std::string& label) {
  return label.substr(0, label.find(':'));
}

// Prints the table by parameter.
void judge(const std::vector<std::string>& labels, const std::vector<World>& worlds, std::size_t seeds) {
  for (const World& world : worlds) {
    Coverage of_world;
    for (const std::string& label : labels) {
      const Coverage found = interval_coverage(label, world, kFirstSeed, seeds, identified);
      const std::string effect = type_of(label);
      Coverage own;
      for (const auto& [name, c] : found)
        if (label.empty() || name.starts_with(effect + ".")) own[name] = c;
      print(world.name, own);
      add(found, of_world);
      // What lies below 90 % for certain (exact interval).
      const Share share = of_effect(found, effect);
      if (share.all > 0) {
        EXPECT_GE(exact_interval(share.inside, share.all).high, 0.90) << label << ", " << world.name;
      }
    }
    const Share inertia = of_effect(of_world, "output_inertia"), all = of_effect(of_world, "");
    fmt::print("{}: output inertia {} of {}, all {} of {}\n", world.name, inertia.inside, inertia.all, all.inside,
               all.all);
    EXPECT_GE(exact_interval(inertia.inside, inertia.all).high, 0.90) << world.name;
    EXPECT_GE(static_cast<double>(all.inside) / static_cast<double>(all.all), 0.90) << world.name;
  }
}

TEST(CatalogueIntervals, HoldTheTruthOfEachEffectInEachWorld) {
  const std::vector<World> worlds = interval_worlds();
  if (whole_campaigns())
    judge(all_labels(), worlds, 25);
  else
    judge({"", "dahl_hysteresis"}, {worlds.front(), worlds.back()}, 4);
}

// The intervals of `add` are those of `identify`.
TEST(CatalogueIntervals, OfAnAddedEffectAreThoseOfTheModelWithIt) {
  plant::Drive drive = plant::demo_plant().drive;
  plant::hide(drive, "cubic_stiffness");
  const data::Dataset dataset =
      dataset_of(drive, plant::record_all(drive, plant::demo_plant().experiments, kFirstSeed));
  const auto added = selection::add(dataset, model_of(drive, false, false), "cubic_stiffness", {});
  const auto identified_with = identified(dataset, model_of(drive, true, false));
  std::size_t compared = 0;
  for (const estimation::Estimate& e : identified_with)
    for (const estimation::Estimate& other : added.estimates) {
      if (e.id != other.id || e.parameter != other.parameter || !e.low || !other.low) continue;
      EXPECT_NEAR(*e.low, *other.low, 1e-3 * (*e.high - *e.low)) << e.id << "." << e.parameter;
      EXPECT_NEAR(*e.high, *other.high, 1e-3 * (*e.high - *e.low)) << e.id << "." << e.parameter;
      ++compared;
    }
  EXPECT_GE(compared, 10u);
}

}  // namespace
}  // namespace flexspline::tests::catalogue_intervals_test
