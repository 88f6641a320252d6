// Settings of a drive that stay when another model goes on it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/drive/settings_text.hpp"
#include "tests/support/two_ampere_drive.hpp"

namespace flexspline::drive::drive_kept_settings_test {
namespace {

using deployment::Unpacked;

Unpacked packed(const model::Model& m, const std::string& settings) {
  deployment::PackOptions options;
  options.samples = 300;
  options.tick_hz = 20'000;
  options.settings = settings;
  return deployment::unpack(deployment::pack(m, options).bytes);
}
std::string with(const std::string& tables) {
  return "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = 4096\n" + tables;
}
double value(const Unpacked& block, const std::string& name) {
  for (const auto& q : block.settings)
    if (q.name == name) return q.value;
  return std::nan("");
}
model::Model stiffer() {
  model::Model m = tests::two_ampere_drive();
  m.effects[2].parameters[0].value = 7000.0;
  return m;
}

TEST(KeptSettings, AStiffnessOfTheModelFollowsTheNewModelAndOneThatWasStatedStays) {
  const Unpacked follows = packed(tests::two_ampere_drive(), with(""));
  EXPECT_NEAR(value(packed(stiffer(), kept_settings(follows, 10.0).text), "feedforward_stiffness"), 7000.0, 1.0);
  const Unpacked stated = packed(tests::two_ampere_drive(), with("[feedforward]\nstiffness_nm_rad = 9000\n"));
  EXPECT_NEAR(value(packed(stiffer(), kept_settings(stated, 10.0).text), "feedforward_stiffness"), 9000.0, 1.0);
}

TEST(KeptSettings, ALoopWithoutAnIntegratorStaysWithoutOne) {
  const Unpacked before = packed(tests::two_ampere_drive(), with("[velocity_loop]\nintegral_nm_rad = 0\n"));
  EXPECT_EQ(value(packed(stiffer(), kept_settings(before, 10.0).text), "integral_gain"), 0.0);
}

TEST(KeptSettings, NoiseAndExcitationThatABlockDoesNotShowAreNamed) {
  EXPECT_TRUE(
      kept_settings(packed(tests::two_ampere_drive(), with("[load]\ninertia_kg_m2 = 0.08\n")), 10.0).warnings.empty());
  const Unpacked noisy = packed(tests::two_ampere_drive(), with("[load]\ntorque_noise_nm = 0.02\n[excitation]\n"));
  const auto warnings = kept_settings(noisy, 10.0).warnings;
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[0].find("[load]"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("[excitation]"), std::string::npos) << warnings[1];
}

TEST(KeptSettings, ALimitThatANewModelCannotHaveIsNamed) {
  const Unpacked before = packed(tests::two_ampere_drive(), with("[limits]\nhighest_rad = 2\n"));
  model::Model weaker = tests::two_ampere_drive();
  weaker.drive.torque_constant_nm_a.value = 0.04;
  const auto changed = changed_settings(before, packed(weaker, kept_settings(before, 10.0).text));
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_EQ(changed[0], "[limits] torque_nm is 0.1 in the active block and 0.08 in the new one");
  EXPECT_TRUE(changed_settings(before, packed(stiffer(), kept_settings(before, 10.0).text)).empty());
}

}  // namespace
}  // namespace flexspline::drive::drive_kept_settings_test
