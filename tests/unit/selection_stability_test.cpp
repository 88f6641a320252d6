// Stability selection on a motion and a torque that are written down: an axis whose viscous friction differs by
// direction.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/engine/selection/frequent_groups.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/stability_selection.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::selection_stability_test {
namespace {

using data::Column;

std::vector<data::Experiment> with_viscous_asymmetry() {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 1e-3);
  std::vector<data::Experiment> all;
  for (const double frequency_hz : {0.41, 0.63}) {
    const double rate = kTurn * frequency_hz;
    all.push_back(
        tests::written_experiment(frequency_hz < 0.5 ? "slow" : "fast", 1e-2, 1000, [&](double t, data::Experiment& e) {
          const double q = 3.0 * std::sin(rate * t) + 0.7 * std::sin(2.3 * rate * t);
          const double w = 3.0 * rate * std::cos(rate * t) + 0.7 * 2.3 * rate * std::cos(2.3 * rate * t);
          const double a =
              -3.0 * rate * rate * std::sin(rate * t) - 0.7 * 2.3 * 2.3 * rate * rate * std::sin(2.3 * rate * t);
          e[Column::motor_position].push_back(q);
          e[Column::motor_torque].push_back(1e-3 * a + 4e-3 * w + std::copysign(0.05, w) + 1.5e-3 * std::abs(w) +
                                            noise(random));
        }));
  }
  return all;
}

class SelectionOnHalves : public ::testing::Test {
 protected:
  SelectionOnHalves() {
    for (const data::Experiment& e : experiments_) pointers_.push_back(&e);
  }
  StabilitySelection selection() const {
    SelectionPolicy fewer = kPolicy;
    fewer.pairs = 4;
    fewer.bandwidths = 2;
    return {pointers_, {}, estimation::terms_of(tests::plain_model()), Balance::motor, fewer};
  }
  static double frequency(const StabilitySelection& selection, std::string_view name) {
    for (const Frequency& f : selection.result().frequencies)
      if (f.name == name) return f.frequency;
    return 0.0;
  }
  std::vector<data::Experiment> experiments_ = with_viscous_asymmetry();
  std::vector<const data::Experiment*> pointers_;
};

TEST_F(SelectionOnHalves, ChoosesTheMissingEffectInNearlyAllSubsamples) {
  const StabilitySelection all = selection();
  EXPECT_GT(frequency(all, "viscous_asymmetry"), 0.9);
  const auto found = frequent_groups(all.result(), kPolicy);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front().group.front().name, "viscous_asymmetry");
}

TEST_F(SelectionOnHalves, WithoutATermChoosesAmongTheOthersAndWithItAgainTheSame) {
  StabilitySelection without = selection();
  without.leave_out({"viscous_asymmetry"});
  EXPECT_EQ(frequency(without, "viscous_asymmetry"), 0.0);
  // Friction that differs by direction is the nearest to it.
  EXPECT_GT(frequency(without, "coulomb_asymmetry"), 0.5);
  StabilitySelection other = selection();
  other.leave_out({"quadratic_drag"});
  EXPECT_GT(frequency(other, "viscous_asymmetry"), 0.9);
}

TEST(CandidateTables, PreslidingShowsAtBandwidthsOfTheMotionAloneAsLawsOfFrictionDo) {
  CandidateTables tables;
  tables.bandwidth.highest_hz = 20.0;
  EXPECT_FALSE(tables.shows_presliding({20.0, false})) << "the model has no friction that it may replace";
  tables.table.presliding.emplace();
  EXPECT_TRUE(tables.shows_presliding({20.0, false}));
  EXPECT_FALSE(tables.shows_presliding({20.0, true})) << "reversals are left out";
  EXPECT_FALSE(tables.shows_presliding({40.0, false})) << "a bandwidth of waves";
  CandidateTerm law, wave;
  wave.highest_hz = 18.0;
  EXPECT_TRUE(tables.may_enter(law, 20.0));
  EXPECT_FALSE(tables.may_enter(law, 40.0));
  EXPECT_TRUE(tables.may_enter(wave, 40.0));
}

}  // namespace
}  // namespace flexspline::selection::selection_stability_test
