// Effects that act on two torque balances: effects that are confounded on one balance are identifiable from the other,
// and their parameters are estimated on both.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/hidden_twin.hpp"

namespace flexspline::other_balances_test {
namespace {

using tests::HiddenTwin;
using tests::in_campaign;
using tests::names;

constexpr std::uint64_t kFirstSeed = 9100;

// In these data the spring is twisted with the motor all but at rest, so that a wave over the motor angle is a constant
// there, as is a wrong zero of torsion or torque; only the motor's balance knows better.
void expect_named(const std::string& hidden, const std::string& name, double scale, double friction_variation) {
  for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + in_campaign(1, 12); ++seed) {
    const HiddenTwin twin(hidden, scale, seed, friction_variation);
    const selection::Diagnosis d = twin.diagnose();
    fmt::print("{} x {:g}, friction {:g}, seed {}: {}\n", hidden, scale, friction_variation, seed, names(d));
    EXPECT_EQ(names(d), name);
  }
}

// The smaller one shows what the larger one does; with friction that differs from run to run friction_differs_test.cpp
// has one of a tenth.
TEST(OtherBalances, DistinguishAnErrorOfTheGearFromAWrongZero) {
  expect_named("kinematic_error", "kinematic_error:2", 0.5, 0.0);
  if (!tests::whole_campaigns()) return;
  expect_named("kinematic_error", "kinematic_error:2", 1.0, 0.0);
  expect_named("kinematic_error", "kinematic_error:2", 1.0, 0.03);
}
TEST(OtherBalances, DistinguishARippleOfTheTorqueSensorFromOneOfTheMotor) {
  expect_named("torque_sensor_ripple", "torque_sensor_ripple:2", 1.0, 0.0);
}

// The spring shows either as well; the free load shows the sensor's offset alone. 0.02 N m.
TEST(OtherBalances, DistinguishAnOffsetOfTheTorqueSensorFromAWrongZero) {
  expect_named("torque_offset", "torque_offset", 0.1, 0.0);
}

// A stiffness that hardens, and a ripple of the motor: each balance lacks an effect of its own.
TEST(OtherBalances, AreEachNamedWhatTheyLack) {
  std::size_t both = 0;
  const auto seeds = in_campaign<std::uint64_t>(1, 4);
  for (std::uint64_t seed = kFirstSeed + 200; seed < kFirstSeed + 200 + seeds; ++seed) {
    const HiddenTwin twin("cubic_stiffness", 2.0, seed, 0.0);
    model::Model base = twin.base;
    std::erase_if(base.effects, [](const model::Effect& e) { return e.type == "coulomb_asymmetry"; });
    const selection::Diagnosis d = selection::diagnose(twin.dataset, base, {});
    fmt::print("seed {}: {}\n", seed, names(d));
    const auto has = [&](const char* name) {
      return std::any_of(d.named.begin(), d.named.end(), [&](const auto& n) { return n.effect == name; });
    };
    both += has("cubic_stiffness") && has("coulomb_asymmetry") ? 1 : 0;
    EXPECT_EQ(d.verdict, selection::Verdict::missing_effect);
    EXPECT_LE(d.named.size(), 2U) << names(d);
    for (const selection::Candidate& c : d.candidates)
      if (c.effect == "cubic_stiffness") {
        EXPECT_EQ(c.balance, estimation::Balance::transmission);
      }
  }
  EXPECT_EQ(both, seeds);
}

TEST(OtherBalances, GiveTheWaveOfTheGearItsPhase) {
  const HiddenTwin twin("kinematic_error", 1.0, kFirstSeed + 50, 0.0);
  const selection::Addition added = selection::add(twin.dataset, twin.base, "kinematic_error:2", {});
  const plant::Effect* truth = nullptr;
  for (const plant::Effect& e : twin.file.drive.effects)
    if (e.hidden) truth = &e;
  ASSERT_TRUE(truth);
  const double height = std::hypot(truth->value("cosine"), truth->value("sine"));
  int tested = 0;
  for (const estimation::Estimate& e : added.estimates) {
    if (e.effect != "kinematic_error" || e.fixed) continue;
    ++tested;
    ASSERT_TRUE(e.std);
    fmt::print("{} {:.4g}, truth {:.4g}, standard error {:.2g}\n", e.parameter, e.value, truth->value(e.parameter),
               *e.std);
    EXPECT_NEAR(e.value, truth->value(e.parameter), 0.05 * height);
    EXPECT_LT(std::abs(e.value - truth->value(e.parameter)), 4.0 * *e.std);
  }
  EXPECT_EQ(tested, 2);
}

}  // namespace
}  // namespace flexspline::other_balances_test
