// Effects with friction that differs by 3 % from record to record: how well their parameters are determined, and what
// is named where friction that differs could pass for them. By least squares with weights by record alone the same
// drives had Stribeck friction off by 37 to 51 % (its velocity by up to 186 %), the asymmetry by 6 and 11 %, the ripple
// by up to 6 %.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/hidden_twin.hpp"

namespace flexspline::friction_differs_test {
namespace {

using tests::HiddenTwin;
using tests::names;

constexpr double kVariation = 0.03;

// In the whole campaign two.
std::vector<std::uint64_t> seeds_from(std::uint64_t first) {
  return tests::whole_campaigns() ? std::vector<std::uint64_t>{first, first + 100} : std::vector{first};
}

// Largest error of the hidden effect's parameters after it was added, over the truth; the two parts of a wave over its
// height.
double worst_error(const std::string& hidden, double scale, std::uint64_t seed) {
  const HiddenTwin drive(hidden, scale, seed, kVariation);
  const selection::Addition added = selection::add(drive.dataset, drive.base, hidden, {});
  const plant::Effect* truth = &drive.truth();
  double height = 0.0;
  for (const plant::Parameter& p : truth->parameters)
    if (p.key == "cosine" || p.key == "sine") height = std::hypot(height, p.value);
  double worst = 0.0;
  for (const estimation::Estimate& e : added.estimates) {
    if (e.id != added.model.effects.back().id || e.fixed || !truth->has(e.parameter)) continue;
    const double is = truth->value(e.parameter), error = (e.value - is) / (height > 0.0 ? height : std::abs(is));
    std::printf("%s x %g seed %llu: %s off by %.2f %%\n", hidden.c_str(), scale, static_cast<unsigned long long>(seed),
                e.parameter.c_str(), 100.0 * error);
    worst = std::max(worst, std::abs(error));
  }
  return worst;
}

class FrictionDiffers : public ::testing::TestWithParam<const char*> {};

TEST_P(FrictionDiffers, AndASmallEffectBesideItIsToldToAFewPercentAllTheSame) {
  for (const std::uint64_t seed : seeds_from(8001)) EXPECT_LT(worst_error(GetParam(), 0.2, seed), 0.04) << seed;
}

INSTANTIATE_TEST_SUITE_P(Effects, FrictionDiffers,
                         ::testing::Values("stribeck_gaussian", "viscous_asymmetry", "torque_ripple:7"),
                         [](const auto& at) {
                           std::string name = at.param;
                           std::erase_if(name, [](char c) { return c == '_' || c == ':'; });
                           return name;
                         });

// Two effects of 2 % of the friction, which fifteen records show not to differ. Where it was taken to differ by 1 %,
// one was chosen by 23 of 100 halves, the other by 59, and none was named.
TEST(FrictionThatDoesNotDiffer, HidesNeitherOfTwoSmallEffects) {
  const HiddenTwin drive("viscous_asymmetry", 1.0, 8301, 0.0);
  model::Model base = drive.base;
  std::erase_if(base.effects, [](const model::Effect& e) { return e.type == "current_offset"; });
  const selection::Diagnosis found = selection::diagnose(drive.dataset, base, {});
  EXPECT_EQ(names(found), "viscous_asymmetry");
}

TEST(FrictionThatDiffers, DoesNotHideWhatIsMissingFromTheErrorAndItsMap) {
  // With friction of each run its own the error would be a fifth.
  const selection::Diagnosis found = HiddenTwin("stribeck_gaussian", 1.0, 8202, 0.0).diagnose();
  ASSERT_EQ(names(found), "stribeck_gaussian");
  EXPECT_GT(found.base_rmse, 15.0 * *found.noise_floor);
  EXPECT_LT(found.base_rmse_own_friction, 0.5 * found.base_rmse);
  const selection::Candidate& first = found.candidates.front();
  EXPECT_GT(first.rmse_cv_before, 15.0 * first.rmse_cv_after);
  ASSERT_TRUE(first.evidence.has_value());
  EXPECT_EQ(first.evidence->variable, "speed");
  double largest = 0.0;
  for (const auto& bin : first.evidence->bins) {
    EXPECT_NEAR(bin.effect, bin.lacking, 3e-4);
    largest = std::max(largest, bin.lacking);
  }
  EXPECT_NEAR(largest, 0.012, 0.0015);
  // An effect that the drive does not have leaves at least as good a fit; its one or two numbers cost some.
  for (const char* name : {"load_dependent_friction", "quadratic_drag", "torque_constant_saturation"})
    for (const selection::Candidate& c : found.candidates)
      if (c.effect == name) {
        EXPECT_GT(c.score, -30.0) << name;
      }
}

TEST(FrictionThatDiffers, DoesNotStandForAnEffectOfTemperature) {
  // What a record has in common shows from record to record only: of the rest it takes a few thousandths.
  EXPECT_EQ(names(HiddenTwin("temperature_coulomb", 0.07, 8204, 0.0).diagnose()), "temperature_coulomb");
}

TEST(FrictionThatDiffers, LeavesAKinematicErrorOnBothBalances) {
  for (const std::uint64_t seed : seeds_from(8205)) {
    const HiddenTwin drive("kinematic_error", 0.1, seed, kVariation);
    // The locked flexspline sees a constant; what the motor feels is a few parts in ten of its noise.
    EXPECT_NE(names(drive.diagnose()).find("kinematic_error"), std::string::npos) << seed;
    const selection::Addition added = selection::add(drive.dataset, drive.base, "kinematic_error:2", {});
    for (const estimation::Estimate& e : added.estimates) {
      if (e.effect != "kinematic_error" || e.fixed) continue;
      std::printf("%s %.3g, standard error %.2g rad\n", e.parameter.c_str(), e.value, e.std.value_or(-1.0));
      ASSERT_TRUE(e.std.has_value());
      EXPECT_LT(*e.std, 2e-6) << e.parameter;
      EXPECT_NEAR(e.value, drive.truth().value(e.parameter), 3.0 * *e.std) << e.parameter << " seed " << seed;
    }
  }
}

TEST(FrictionThatDiffers, DoesNotMakeASmearedDahlLawALugre) {
  // A presliding of 13 encoder counts: what the encoder leaves, a law of five parameters bends to.
  for (const std::uint64_t seed : seeds_from(8206))
    EXPECT_EQ(names(HiddenTwin("dahl_friction", 0.1, seed, kVariation).diagnose()), "dahl_friction") << seed;
}

}  // namespace
}  // namespace flexspline::friction_differs_test
