// Names that are fitted as `add` fits them.
#include "host/engine/selection/refitted_names.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/plain_model.hpp"
#include "tests/support/swinging_axis.hpp"

namespace flexspline::selection::selection_refitted_names_test {
namespace {

// A swinging axis with dry friction alone; viscous friction is larger in one direction by twice `asymmetry`, N*m*s/rad.
data::Dataset axis_with(double asymmetry) {
  using data::Column;
  data::Dataset dataset = tests::swinging_axis(1e-6);
  for (data::Experiment& e : dataset.experiments) {
    const std::vector<double>& q = e[Column::motor_position];
    std::vector<double>& torque = e[Column::motor_torque];
    for (std::size_t k = 1; k + 1 < q.size(); ++k)
      torque[k] += asymmetry * std::abs(q[k + 1] - q[k - 1]) / (2.0 * e.sample_s);
  }
  return dataset;
}

// What is left of the name, on that data.
Diagnosis judged(double asymmetry, Diagnosis result) {
  result.verdict = Verdict::missing_effect;
  result.named = {{"viscous_asymmetry", {}}};
  take_back_where_refit_holds_zero(axis_with(asymmetry), tests::plain_model(), {}, result);
  return result;
}

TEST(RefittedNames, OneWhoseIntervalHoldsZeroIsTakenBackAndIsPossibleWhereHalvesDecide) {
  Diagnosis halves;
  halves.resampling.emplace();
  halves.resampling->decides = true;
  const Diagnosis result = judged(0.0, halves);
  EXPECT_TRUE(result.named.empty());
  ASSERT_EQ(result.possible.size(), 1u);
  EXPECT_NE(result.possible.front().why_not.find("its values do not differ from zero"), std::string::npos);
}

TEST(RefittedNames, OneThatTheDataHoldStays) {
  EXPECT_EQ(judged(1e-3, {}).named.size(), 1u);
}

TEST(RefittedNames, OneThatHeldOutExperimentsConfirmIsNotJudged) {
  Diagnosis confirmed;
  confirmed.resampling.emplace();
  confirmed.resampling->decides = true;
  Resampling::FoundTerm& found = confirmed.resampling->found.emplace_back();
  found.group = {{"viscous_asymmetry", {}}};
  found.held_out_ratio = 0.9;
  EXPECT_EQ(judged(0.0, confirmed).named.size(), 1u);
}

}  // namespace
}  // namespace flexspline::selection::selection_refitted_names_test
