// Which of many drives differs: no false alarm where none does, and one moved drive found.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "host/app/fleet/siblings.hpp"

namespace flexspline::fleet::fleet_siblings_test {
namespace {

std::vector<DriveResult> gaussian_fleet(std::mt19937_64& random, std::size_t drives, std::size_t quantities) {
  std::normal_distribution<double> normal;
  std::vector<DriveResult> fleet(drives);
  for (std::size_t i = 0; i < drives; ++i) {
    fleet[i].drive = "drive-" + std::to_string(i);
    for (std::size_t k = 0; k < quantities; ++k)
      fleet[i].quantities.push_back({"q" + std::to_string(k), "N*m", 0.05 + 0.001 * normal(random), std::nullopt});
  }
  return fleet;
}

TEST(FleetSiblings, OneFleetInAHundredOfEqualDrivesHasAFalseAlarm) {
  std::mt19937_64 random(7);
  const double limit = usual_limit(12, 5);
  int alarms = 0;
  for (int k = 0; k < 1000; ++k) {
    const std::vector<DriveResult> fleet = gaussian_fleet(random, 12, 5);
    if (!merge(fleet, limit).differences.empty()) ++alarms;
  }
  // Ten expected; the limit itself comes from twenty thousand fleets. Three standard errors each way.
  EXPECT_LE(alarms, 22);
  EXPECT_GE(alarms, 2);
}

TEST(FleetSiblings, TheLimitFallsAsSiblingsGetMore) {
  EXPECT_GT(usual_limit(5, 5), usual_limit(12, 5));
  EXPECT_GT(usual_limit(12, 5), usual_limit(60, 5));
  // Beyond what a normal distribution gives to the largest of 300 values.
  EXPECT_GT(usual_limit(60, 5), 3.0);
}

TEST(FleetSiblings, AMovedDriveIsNamedWithTheQuantityThatMoved) {
  std::mt19937_64 random(3);
  std::vector<DriveResult> fleet = gaussian_fleet(random, 12, 5);
  fleet[4].quantities[2].value = 0.05 - 0.03;
  const Merged merged = merge(fleet);
  ASSERT_EQ(merged.differences.size(), 1u);
  EXPECT_EQ(merged.differences[0].drive, "drive-4");
  EXPECT_EQ(merged.differences[0].name, "q2");
  EXPECT_LT(merged.differences[0].z, -merged.limit);
  EXPECT_NEAR(merged.spreads[2].median, 0.05, 0.001);
}

TEST(FleetSiblings, AValueThatIsItselfUncertainIsNoDifference) {
  std::mt19937_64 random(3);
  std::vector<DriveResult> fleet = gaussian_fleet(random, 12, 1);
  fleet[4].quantities[0] = {"q0", "N*m", 0.02, 0.02};
  EXPECT_TRUE(merge(fleet).differences.empty());
}

TEST(FleetSiblings, FourDrivesAreTooFew) {
  std::mt19937_64 random(3);
  std::vector<DriveResult> fleet = gaussian_fleet(random, 4, 1);
  fleet[0].quantities[0].value = 5.0;
  EXPECT_TRUE(merge(fleet).differences.empty());
}

TEST(FleetSiblings, AnotherVerdictThanThatOfMostIsReported) {
  std::mt19937_64 random(3);
  std::vector<DriveResult> fleet = gaussian_fleet(random, 6, 1);
  for (DriveResult& drive : fleet) drive.verdict = "at_noise_floor";
  fleet[1].verdict = "missing_effect";
  fleet[1].named = {"an_effect"};
  fleet[2].failed = "no data";
  const Merged merged = merge(fleet);
  EXPECT_EQ(merged.usual_verdict, "at_noise_floor");
  ASSERT_EQ(merged.verdicts.size(), 1u);
  EXPECT_EQ(merged.verdicts[0]->drive, "drive-1");
  ASSERT_EQ(merged.failed.size(), 1u);
  EXPECT_EQ(merged.failed[0]->drive, "drive-2");
}

TEST(FleetSiblings, ADamagedResultIsRefusedByName) {
  const nlohmann::json other = {{"format", "flexspline-identify/1"}};
  EXPECT_THROW(result_from(other, "a.json"), FleetError);
  const nlohmann::json without = {{"format", kResultFormat}, {"drive", "a"}};
  try {
    result_from(without, "a.json");
    FAIL();
  } catch (const FleetError& error) {
    EXPECT_NE(std::string(error.what()).find("a.json"), std::string::npos);
  }
}

}  // namespace
}  // namespace flexspline::fleet::fleet_siblings_test
