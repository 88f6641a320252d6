// The size of a named effect against the amplitude that was put into a record.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/selection/confounding.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/ripple_candidate.hpp"

namespace flexspline::selection::selection_effect_size_test {
namespace {

using data::Column;
using estimation::Balance;

constexpr double kAmplitude_nm = 0.02;

// Inertia, viscous and Coulomb friction and a ripple of three a turn over many turns.
data::Experiment rippled_experiment() {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 5e-4);
  data::Experiment e;
  e.name = "rippled";
  e.sample_s = 2e-3;
  e.current_hold = data::CurrentHold::none;
  const double rate = kTurn * 0.2123, reach = 20.0;
  for (std::size_t k = 0; k < 8000; ++k) {
    const double t = 2e-3 * static_cast<double>(k);
    const double q = reach * std::sin(rate * t), w = reach * rate * std::cos(rate * t), a = -rate * rate * q;
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(1e-3 * a + 4e-3 * w + std::copysign(0.05, w) +
                                      kAmplitude_nm * std::cos(3.0 * q + 0.4) + noise(random));
  }
  e.segments = {{0, e.size()}};
  return e;
}

Candidate named_ripple(const model::Drive& drive) {
  const data::Experiment e = rippled_experiment();
  const estimation::PreparedData prepared = estimation::prepare({&e}, {}, {20.0, true});
  RegressionProblem data(prepared, Balance::motor);
  const Terms terms = estimation::terms_of(tests::plain_model());
  const Eigen::VectorXd keep = Eigen::VectorXd::Ones(data.rows());
  BalanceSearch search{&data, keep, cross_validate(data, terms, keep)};
  Diagnosis result;
  result.named = {{"torque_ripple", 3.0}};
  result.candidates.resize(1);
  result.candidates.front().effect = "torque_ripple";
  result.candidates.front().order = 3.0;
  explain_named(search, {tests::ripple_candidate(search, 3.0, keep)}, drive, result);
  return result.candidates.front();
}

TEST(EffectSize, OfARippleIsItsAmplitudeAtThePeakAndItsRmsInPercentOfTheRatedTorqueAtTheMotor) {
  model::Drive drive = tests::plain_model().drive;
  drive.gear_ratio.value = 50.0;
  drive.rated_torque_nm.value = 10.0;
  const Candidate c = named_ripple(drive);
  ASSERT_TRUE(c.size.has_value());
  // What the filter leaves at reversals adds to the largest value.
  EXPECT_NEAR(c.size->peak, kAmplitude_nm, 0.1 * kAmplitude_nm);
  EXPECT_NEAR(c.size->rms, kAmplitude_nm / std::sqrt(2.0), 0.05 * kAmplitude_nm);
  ASSERT_TRUE(c.size->percent_of_rated.has_value());
  EXPECT_NEAR(*c.size->percent_of_rated, 100.0 * c.size->rms * 50.0 / 10.0, 1e-9);
}

TEST(EffectSize, HasNoPercentageWhereTheModelStatesNoRatedTorque) {
  model::Drive drive = tests::plain_model().drive;
  drive.rated_torque_nm.value.reset();
  const Candidate c = named_ripple(drive);
  ASSERT_TRUE(c.size.has_value());
  EXPECT_FALSE(c.size->percent_of_rated.has_value());
}

}  // namespace
}  // namespace flexspline::selection::selection_effect_size_test
