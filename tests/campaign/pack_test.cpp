// Parameter blocks of many models: all that are admitted are as near to double as promised, and the proof holds.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/fixed_point_check.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "tests/support/random_model.hpp"

namespace flexspline::tests::pack_test {
namespace {

using deployment::PackError;
using deployment::PackOptions;

constexpr double kBound = 1e-6;  // of rated torque

// The error that counts is on other samples than those that pack looked at.
TEST(PackedModels, ThreeHundredAreWithinAMillionthOfRatedTorqueAndOthersRefusedWithAReason) {
  std::mt19937 random(7101);
  PackOptions options;
  options.samples = 4000;
  options.measured = true;  // other samples are used here; the proof has a test of its own
  int admitted = 0, refused = 0, above_bound = 0;
  double worst = 0.0;
  while (admitted < 300 && admitted + refused + above_bound < 3000) {
    options.seed = random();
    const model::Model m = random_model(random);
    try {
      const auto packed = deployment::pack(m, options);
      ++admitted;
      EXPECT_TRUE(deployment::unpack(packed.bytes).coefficients_follow);
      const auto effects = values_of(m);
      const auto drive = deployment::widened(deployment::bases_of(m, 1.0 / options.tick_hz), packed.torque_scale);
      const auto other = deployment::compare(effects, drive, deployment::prove(effects, drive), 4000, random());
      const double rated = *m.drive.rated_torque_nm.value;
      worst = std::max({worst, other.worst[0] * drive.torque_base / (rated / drive.gear_ratio),
                        other.worst[1] * drive.output_torque_base / rated,
                        other.worst[2] * drive.output_torque_base / rated});
    } catch (const deployment::BoundError&) {
      ++above_bound;
    } catch (const PackError& error) {
      ++refused;
      const std::string reason = error.what();
      EXPECT_TRUE(reason.find("does not fit") != std::string::npos ||
                  reason.find("the proof fails") != std::string::npos)
          << reason;
    }
  }
  std::printf("%d admitted, %d do not fit, %d above the bound; worst error of those admitted %.2g of rated torque\n",
              admitted, refused, above_bound, worst);
  EXPECT_EQ(admitted, 300);
  EXPECT_LE(above_bound, 6);
  EXPECT_LT(worst, kBound);
}

// The bounds are of intervals; no sample of a million may be beyond them.
TEST(PackedModels, NoneOfAMillionDirectedSamplesLeavesItsProof) {
  std::mt19937 random(7102);
  std::size_t samples = 0;
  while (samples < 1'000'000) {
    const model::Model m = random_model(random);
    const auto effects = values_of(m);
    try {
      const auto drive = deployment::bases_of(m, 1.0 / 16000.0);
      const auto bounds = deployment::prove(effects, drive);
      if (!bounds.holds) continue;
      const auto difference = deployment::compare(effects, drive, bounds, 20'000, random());
      samples += 20'000;
      EXPECT_TRUE(difference.within);
      EXPECT_EQ(difference.finding, "");
    } catch (const PackError&) {
    }
  }
}

}  // namespace
}  // namespace flexspline::tests::pack_test
