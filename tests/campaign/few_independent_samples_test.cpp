// Records with hardly more independent samples than the model has parameters: the error on data left out of the fit is
// then far above that of the fit, and nothing is named.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/selection/diagnosis.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::few_independent_samples_test {
namespace {

using data::Column;

// Slow strokes of an axis that lacks nothing but `drag`, N m s^2/rad^2.
Diagnosis of_strokes(double length_s, double drag) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> noise;
  data::Dataset dataset;
  dataset.experiments.push_back(tests::written_experiment(
      "strokes", 4e-3, static_cast<std::size_t>(length_s / 4e-3), [&](double t, data::Experiment& e) {
        const double rate = 0.5 * kTurn, q = 20.0 * std::sin(rate * t), w = 20.0 * rate * std::cos(rate * t);
        e[Column::motor_position].push_back(q);
        e[Column::motor_torque].push_back(-1e-4 * rate * rate * q + 1e-3 * w + std::copysign(0.05, w) +
                                          drag * w * std::abs(w) + 5e-3 * noise(random));
      }));
  const model::Model model = tests::plain_model_with(
      {"coulomb_asymmetry", "viscous_asymmetry", "torque_bias", "power_law_friction", "gravity"});
  return diagnose(dataset, model, {});
}

TEST(FewIndependentSamples, NameNothingAndSayWhy) {
  const Diagnosis few = of_strokes(2.5, 2e-5);
  EXPECT_GT(std::pow(few.base_rmse_cv / few.base_rmse, 2), 2.0);
  EXPECT_EQ(few.verdict, Verdict::insufficient_excitation);
  EXPECT_TRUE(few.named.empty());
  EXPECT_NE(few.warnings.back().find("too few independent samples"), std::string::npos) << few.warnings.back();
}

TEST(FewIndependentSamples, AreNoneOfALongRecordOfTheSameMotion) {
  const Diagnosis many = of_strokes(60.0, 0.0);
  EXPECT_LT(std::pow(many.base_rmse_cv / many.base_rmse, 2), 1.2);
  EXPECT_NE(many.verdict, Verdict::insufficient_excitation);
}

}  // namespace
}  // namespace flexspline::selection::few_independent_samples_test
