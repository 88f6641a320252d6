// The numbers of the drive over many drives and long times: 100 random blocks over the whole envelope, in the whole
// campaign 300, and hysteresis in motion so slow that each tick moves a state by less than a signal could show.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/campaign_size.hpp"
#include "tests/support/drive_trial.hpp"

namespace flexspline::tests::fixed_point_test {
namespace {

const int kBlocks = tests::in_campaign(100, 300);
constexpr double kBoundOfAnEffect = 1e-6;  // of rated torque

TEST(FixedPoint, EachEffectIsWithinAMillionthOfRatedTorqueOverTheEnvelope) {
  for (const std::string& name : names_on_drive()) {
    Random random(7001);
    double worst = 0.0, largest = 0.0;
    int blocks = 0, draws = 0;
    while (blocks < kBlocks && draws < 20 * kBlocks) {
      ++draws;
      const DriveConstants<double> drive = random_drive(random);
      auto models = admissible_block({&catalogue::get(name)}, drive, random);
      if (!models) continue;
      ++blocks;
      const Trial trial = run(*models, drive, random, 2000);
      worst = std::max(worst, trial.worst);
      largest = std::max(largest, trial.largest);
      ASSERT_TRUE(trial.same_bits) << name;
      ASSERT_TRUE(trial.within_proof) << name;
      ASSERT_EQ(trial.findings, 0) << name << ": " << OverflowLog::first();
    }
    std::printf("%-32s worst error %.1e of rated torque, largest torque %5.2f, %d blocks of %d drawn\n", name.c_str(),
                worst, largest, blocks, draws);
    EXPECT_EQ(blocks, kBlocks) << name;
    EXPECT_LT(worst, kBoundOfAnEffect) << name;
  }
}

// Blocks of a dozen effects, none of which stands in for another.
TEST(FixedPoint, TheirSumIsWithinTheProofAndAMillionthForEachOverTheEnvelope) {
  Random random(7002);
  const std::vector<std::string> names = names_on_drive();
  double worst = 0.0;
  int blocks = 0, draws = 0;
  std::size_t effects_in_all = 0;
  while (blocks < kBlocks && draws < 100 * kBlocks) {
    ++draws;
    std::vector<const catalogue::Entry*> chosen;
    for (int k = 0; k < 12; ++k) {
      const catalogue::Entry& entry = catalogue::get(names[random() % names.size()]);
      const bool clashes = std::any_of(chosen.begin(), chosen.end(), [&](const catalogue::Entry* other) {
        return other == &entry || catalogue::names_contain(entry.info->replaces, other->name()) ||
               catalogue::names_contain(other->info->replaces, entry.name());
      });
      if (!clashes) chosen.push_back(&entry);
    }
    const DriveConstants<double> drive = random_drive(random);
    auto models = admissible_block(chosen, drive, random);
    if (!models) continue;
    ++blocks;
    effects_in_all += chosen.size();
    const Trial trial = run(*models, drive, random, 4000);
    worst = std::max(worst, trial.worst);
    ASSERT_TRUE(trial.same_bits);
    EXPECT_LT(trial.worst, kBoundOfAnEffect * static_cast<double>(chosen.size()));
    ASSERT_TRUE(trial.within_proof);
    ASSERT_EQ(trial.findings, 0) << OverflowLog::first();
  }
  std::printf("%d blocks of %d drawn, %.1f effects each: worst error %.1e of rated torque\n", blocks, draws,
              static_cast<double>(effects_in_all) / blocks, worst);
  EXPECT_EQ(blocks, kBlocks);
}

// Ten minutes at a millionth of rated speed: the gear's play of a few characteristic lengths, in ten million ticks. The
// exact answer is one step of the same length in long double, as these laws are rate independent.
class SlowHysteresis : public ::testing::TestWithParam<std::string> {};

TEST_P(SlowHysteresis, LosesLessThanATenThousandthOfItsBoundInTenMinutes) {
  const catalogue::Entry& entry = catalogue::get(GetParam());
  Random random(1);
  DriveConstants<double> drive = random_drive(random);
  drive.rated_velocity = drive.velocity_base = 200.0;
  std::vector<double> usual;
  for (const effects::ParameterInfo& p : entry.parameters) usual.push_back(p.usual);
  Models slow, fast;
  ASSERT_TRUE(slow.add_named(entry.name(), usual, drive));
  ASSERT_TRUE(fast.add_named(entry.name(), usual, drive));
  constexpr int kTicks = 600 * 16'000;
  const double step_turns = 1e-6 * drive.rated_velocity * kTickS / kTurn;
  // The load is locked: the whole motion of the motor twists the gear.
  const double step_torsion = step_turns * kTurn / drive.gear_ratio / drive.torsion_base;
  const auto at = [&](double tick, double direction) {
    Inputs<Fixed> in;
    in.angle.raw = std::llround(std::ldexp(step_turns * tick, 32));
    in.torsion = Fixed::value(step_torsion * tick);
    in.velocity = Fixed::value(1e-6 * direction);
    in.direction = in.torsion_direction = Fixed::value(direction);
    in.torque = Fixed::value(0.1);
    return in;
  };
  double worst = 0.0, bound = 0.0;
  fast.real.tick(in_double(at(0, 1)));
  int last = 0;
  for (int tick = 0; tick <= kTicks; ++tick) {
    // Back from two thirds on.
    const int turn = 2 * (kTicks / 3);
    const int place = tick <= turn ? tick : 2 * turn - tick;
    const auto torques = slow.fixed.tick(at(place, tick <= turn ? 1 : -1));
    if (tick % 100'000 != 0 && tick != turn) continue;
    // The exact law in a thousand steps from the last look on.
    for (int part = 1; part <= 1000; ++part)
      if (place != last) fast.real.tick(in_double(at(last + (place - last) * (part / 1000.0), tick <= turn ? 1 : -1)));
    last = place;
    const auto exact = fast.real.tick(in_double(at(place, tick <= turn ? 1 : -1)));
    worst = std::max({worst, std::abs(real(torques.motor) - exact.motor),
                      std::abs(real(torques.transmission) - exact.transmission)});
    bound = std::max({bound, std::abs(exact.motor), std::abs(exact.transmission)});
  }
  std::printf("%-32s worst %.1e of the largest torque\n", GetParam().c_str(), worst / bound);
  EXPECT_GT(bound, 1e-3);
  EXPECT_LT(worst, 1e-4 * bound);
}

INSTANTIATE_TEST_SUITE_P(Laws, SlowHysteresis,
                         ::testing::Values("dahl_friction", "lugre_friction", "dahl_hysteresis",
                                           "modified_dahl_hysteresis", "duhem_hysteresis", "bouc_wen_hysteresis",
                                           "prandtl_ishlinskii_hysteresis", "torque_proportional_hysteresis"),
                         [](const auto& at) { return at.param; });

}  // namespace
}  // namespace flexspline::tests::fixed_point_test
