// The verdict where names are taken back after it was made.
#include <gtest/gtest.h>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/remainder.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/swinging_axis.hpp"

namespace flexspline::selection::selection_taken_back_test {
namespace {

Diagnosis with(Verdict verdict, std::vector<NamedEffect> named) {
  Diagnosis result;
  result.verdict = verdict;
  result.named = std::move(named);
  result.recovered_percent = 80.0;
  return result;
}

TEST(TakenBack, AVerdictFollowsTheNamesThatAreLeft) {
  const data::Dataset dataset = tests::swinging_axis(0.5);
  const auto fitted = estimation::identify(dataset, tests::plain_model(), {});
  const estimation::RegressionProblem& data = fitted->data.front();
  SearchedBalance motor;
  motor.search = {&data, Eigen::VectorXd::Ones(data.rows()), {}};
  motor.search.base = cross_validate(data, fitted->terms, motor.search.keep);

  Diagnosis none = with(Verdict::missing_effect, {});
  EXPECT_TRUE(follow_names(motor, none));
  EXPECT_EQ(none.verdict, Verdict::nothing_significant);
  EXPECT_FALSE(none.recovered_percent);
  none = with(Verdict::confusable_effects, {});
  none.noise_floor = 10.0 * motor.search.base.rmse();
  EXPECT_TRUE(follow_names(motor, none));
  EXPECT_EQ(none.verdict, Verdict::at_noise_floor);

  Diagnosis one = with(Verdict::confusable_effects, {{"dahl_friction", std::nullopt}});
  EXPECT_FALSE(follow_names(motor, one));
  EXPECT_EQ(one.verdict, Verdict::missing_effect);
  EXPECT_TRUE(one.recovered_percent);

  Diagnosis unknown = with(Verdict::unknown_structure, {});
  EXPECT_FALSE(follow_names(motor, unknown));
  EXPECT_EQ(unknown.verdict, Verdict::unknown_structure);
}

}  // namespace
}  // namespace flexspline::selection::selection_taken_back_test
