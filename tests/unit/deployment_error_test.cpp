// The proof of the error by parts: what it bounds is never exceeded, what it cannot bound it says.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/error_proof.hpp"
#include "host/drive_link/deployment/on_numbers.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/deployment/samples.hpp"
#include "tests/support/random_model.hpp"

namespace flexspline::tests::deployment_error_test {
namespace {

using deployment::ErrorProof;

constexpr double kTickS = 1.0 / 16'000.0;

model::Model drive_with(const std::vector<std::string>& types) {
  model::Model m;
  m.name = "some";
  m.drive.gear_ratio.value = 100.0;
  m.drive.torque_constant_nm_a.value = 0.05;
  m.drive.rated_current_a.value = 2.0;
  m.drive.rated_velocity_rad_s.value = 200.0;
  m.drive.rated_torque_nm.value = 40.0;
  for (const std::string& type : types) {
    const catalogue::Entry& entry = catalogue::get(type);
    model::Effect e = catalogue::blank_effect(entry, data::Axis::rotary);
    e.id = type;
    for (std::size_t p = 0; p < entry.parameters.size(); ++p) e.parameters[p].value = entry.parameters[p].usual;
    m.effects.push_back(e);
  }
  return m;
}
ErrorProof proof_of(const model::Model& m) {
  return deployment::prove_error(values_of(m), deployment::bases_of(m, kTickS));
}
std::string unproven(const ErrorProof& proof, const std::string& id) {
  for (const auto& part : proof.parts)
    if (part.id == id) return part.unproven;
  return "no such part";
}

// Samples of a model that fits and whose range is proven; how many were looked at.
std::size_t expect_within(const model::Model& m, std::size_t samples, std::uint64_t seed) {
  const auto effects = values_of(m);
  try {
    const auto drive = deployment::bases_of(m, kTickS);
    const auto range = deployment::prove(effects, drive);
    if (!range.holds) return 0;
    const auto proof = deployment::prove_error(effects, drive);
    const auto seen = deployment::compare(effects, drive, range, samples, seed);
    for (std::size_t b = 0; b < proof.sum.size(); ++b) {
      for (std::size_t e = 0; e < effects.size(); ++e)
        if (proof.parts[e].unproven.empty()) {
          EXPECT_LE(seen.parts[e][b], proof.parts[e].bound[b]) << effects[e].id << ", balance " << b;
        }
      if (proof.holds) {
        EXPECT_LE(seen.worst[b], proof.sum[b]) << "sum, balance " << b;
      }
    }
  } catch (const deployment::PackError&) {
    return 0;
  }
  return samples;
}

TEST(ErrorProof, HoldsForEveryEffectAndForSumsAlongAHundredThousandDirectedSamples) {
  std::mt19937 random(7401);
  std::size_t samples = 0;
  for (const catalogue::Entry& entry : catalogue::all())
    if (!entry.info->host_only) samples += expect_within(random_model(random, &entry), 1'000, random());
  while (samples < 100'000) samples += expect_within(random_model(random), 4'000, random());
}

// A weight is rounded to 2^-27 and its product is exact: two bases of acceleration make twice what it is off.
TEST(ErrorProof, OfAnInertiaIsTheRoundingOfItsOneCoefficientAtTheEndOfTheEnvelope) {
  const model::Model m = drive_with({"inertia"});
  const auto d = deployment::bases_of(m, kTickS);
  const double weight = *m.effects[0].parameters[0].value * d.acceleration_base / d.torque_base;
  const double off = std::abs(std::ldexp(std::round(std::ldexp(weight, 27)), -27) - weight);
  EXPECT_NEAR(proof_of(m).sum[0], 2.0 * off, 1e-10);
}

// What is proven and compared runs effect by effect; what a drive runs is the tick.
TEST(ErrorProof, IsOfATickThatGivesTheBitsOfTheDrivesOwn) {
  std::mt19937 random(7402);
  for (int k = 0; k < 10; ++k) {
    const model::Model m = random_model(random);
    const auto effects = values_of(m);
    const auto drive = deployment::widened(deployment::bases_of(m, kTickS), 8.0);
    std::unique_ptr<model::DriveModel<fixed::Fixed>> whole, parted;
    try {
      whole = deployment::model_of<fixed::Fixed>(effects, drive);
      parted = deployment::model_of<fixed::Fixed>(effects, drive);
    } catch (const deployment::PackError&) {
      continue;
    }
    deployment::Samples motion(drive, random());
    for (int i = 0; i < 500; ++i) {
      const auto in = motion.next();
      const auto a = whole->tick(in);
      const auto b = parted->tick_by_effect(
          in, []<class Effect>(auto&... all) { model::DriveModel<fixed::Fixed>::run<Effect>(all...); });
      ASSERT_EQ(a.motor.raw, b.motor.raw);
      ASSERT_EQ(a.transmission.raw, b.transmission.raw);
      ASSERT_EQ(a.load.raw, b.load.raw);
    }
  }
}

TEST(ErrorProof, OfASumIsTheSumOfItsParts) {
  const ErrorProof proof = proof_of(drive_with({"inertia", "viscous_friction", "lugre_friction", "linear_stiffness"}));
  ASSERT_TRUE(proof.holds);
  for (std::size_t b = 0; b < proof.sum.size(); ++b) {
    double sum = 0.0;
    for (const auto& part : proof.parts) sum += part.bound[b];
    EXPECT_DOUBLE_EQ(proof.sum[b], sum);
  }
  EXPECT_EQ(proof.sum[2], 0.0);
}

TEST(ErrorProof, IsUsefulForUsualDrives) {
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (entry.info->host_only) continue;
    const ErrorProof proof = proof_of(drive_with({std::string(entry.name())}));
    if (proof.holds) {
      for (const double bound : proof.sum) EXPECT_LT(bound, entry.has_state ? 1e-4 : 1e-6) << entry.name();
    }
  }
}

TEST(ErrorProof, SaysWhyThereIsNone) {
  EXPECT_NE(unproven(proof_of(drive_with({"bouc_wen_hysteresis"})), "bouc_wen_hysteresis").find("own state"),
            std::string::npos);
  model::Model m = drive_with({"dahl_hysteresis"});
  EXPECT_EQ(unproven(proof_of(m), "dahl_hysteresis"), "");
  m.effects[0].parameters.back().value = 0.8;
  EXPECT_NE(unproven(proof_of(m), "dahl_hysteresis").find("faster"), std::string::npos);
  m = drive_with({"torque_proportional_hysteresis"});
  EXPECT_EQ(unproven(proof_of(m), "torque_proportional_hysteresis"), "");
  m.effects[0].parameters[0].value = 0.0;
  EXPECT_NE(unproven(proof_of(m), "torque_proportional_hysteresis").find("zero"), std::string::npos);
}

// What a constant adds to a torsion is the same in each tick; what a wave or a dead zone adds is not.
TEST(ErrorProof, OfATorsionHysteresisNeedsATorsionThatNothingButAConstantChanged) {
  EXPECT_TRUE(proof_of(drive_with({"torsion_zero", "dahl_hysteresis"})).holds);
  for (const char* shift : {"kinematic_error", "backlash"}) {
    const ErrorProof proof = proof_of(drive_with({shift, "modified_dahl_hysteresis"}));
    EXPECT_NE(unproven(proof, "modified_dahl_hysteresis").find("another effect"), std::string::npos) << shift;
    EXPECT_EQ(unproven(proof, shift), "") << shift;
    EXPECT_FALSE(proof.holds);
  }
}

TEST(ErrorProof, IsAskedForByPackUnlessMeasured) {
  deployment::PackOptions options;
  options.samples = 300;
  const model::Model m = drive_with({"viscous_friction", "bouc_wen_hysteresis"});
  try {
    deployment::pack(m, options);
    ADD_FAILURE() << "packed";
  } catch (const deployment::UnprovenError& error) {
    const std::string reason = error.what();
    EXPECT_NE(reason.find("bouc_wen_hysteresis"), std::string::npos) << reason;
    EXPECT_NE(reason.find("--measured"), std::string::npos) << reason;
  }
  options.measured = true;
  const auto packed = deployment::pack(m, options);
  EXPECT_FALSE(packed.error_is_proven);
  int parts = 0;
  for (const auto& part : packed.proof) {
    if (part.kind != "error") continue;
    ++parts;
    ASSERT_TRUE(part.observed && part.share_of_rated);
    const bool proven = part.part == "viscous_friction";
    EXPECT_EQ(part.unproven.empty(), proven) << part.part;
    EXPECT_EQ(std::isfinite(part.bound), proven) << part.part;
  }
  EXPECT_EQ(parts, 2 + 3);
  const auto proven = deployment::pack(drive_with({"viscous_friction"}), {});
  EXPECT_TRUE(proven.error_is_proven);
  EXPECT_GE(proven.error_bound_share_of_rated, proven.max_error_share_of_rated);
}

}  // namespace
}  // namespace flexspline::tests::deployment_error_test
