// Records whose inertia differs, and records whose effort comes late: axes in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/selection/cross_validation.hpp"
#include "host/engine/selection/record_inertia.hpp"
#include "host/engine/selection/record_laws.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::selection_record_inertia_test {
namespace {

using data::Column;

constexpr double kViscous = 2e-3, kCoulomb = 0.05;

// Two sines, the faster the higher the record's number; the torque is that of `late_s` before.
data::Experiment axis(int record, double inertia, double late_s, std::mt19937_64& random) {
  const double a = 2.5 + 1.1 * record, b = 2.7 * a;
  const auto velocity = [=](double t) { return 20.0 * std::sin(a * t) + 9.0 * std::sin(b * t + 1.0); };
  const auto acceleration = [=](double t) { return 20.0 * a * std::cos(a * t) + 9.0 * b * std::cos(b * t + 1.0); };
  std::normal_distribution<double> noise(0.0, 1e-3);
  return tests::written_experiment("record-" + std::to_string(record), 1e-3, 8000, [&](double t, data::Experiment& e) {
    const double before = t - late_s;
    e[Column::motor_position].push_back(-20.0 / a * std::cos(a * t) - 9.0 / b * std::cos(b * t + 1.0));
    e[Column::motor_torque].push_back(inertia * acceleration(before) + kViscous * velocity(before) +
                                      std::copysign(kCoulomb, velocity(before)) + noise(random));
  });
}

struct Fitted {
  data::Dataset dataset;
  std::unique_ptr<estimation::Identification> found;
  BalanceSearch search;
};

std::unique_ptr<Fitted> fitted(double other_inertia, double late_s) {
  auto fit = std::make_unique<Fitted>();
  std::mt19937_64 random(4);
  for (int record = 0; record < 6; ++record)
    fit->dataset.experiments.push_back(axis(record, record % 2 == 0 ? 1e-3 : other_inertia, late_s, random));
  fit->found = estimation::identify(fit->dataset, tests::plain_model(), {});
  const RegressionProblem& data = fit->found->data.front();
  fit->search = {&data, Eigen::VectorXd::Ones(data.rows()), {}};
  fit->search.base = cross_validate(data, fit->found->terms, fit->search.keep);
  return fit;
}

TEST(RecordInertia, ThatDiffersIsFoundWithItsRangeAndHowMuchItExplains) {
  const auto fit = fitted(1.3e-3, 0.0);
  const auto own = inertia_by_record(*fit->found, fit->search);
  ASSERT_TRUE(own);
  EXPECT_EQ(own->parameter, "inertia.inertia");
  EXPECT_NEAR(own->least, 1e-3, 2e-5);
  EXPECT_NEAR(own->most, 1.3e-3, 2e-5);
  EXPECT_GT(own->explains_percent, 80.0);
  EXPECT_NE(inertia_text(*own).find("Was the load changed, or the posture of other joints?"), std::string::npos);
}

TEST(RecordInertia, ThatIsOneIsNotSaidToDiffer) {
  const auto fit = fitted(1e-3, 0.0);
  EXPECT_FALSE(inertia_by_record(*fit->found, fit->search));
}

// The torque of 4 ms ago is short by 4 ms times its slope, most of all in fast records.
TEST(RecordFriction, OfAnEffortThatComesLateIsThatOfItsOwnTime) {
  const auto fit = fitted(1e-3, 0.004);
  const RecordFriction own = friction_by_record(*fit->found, *fit->search.data, 3);
  ASSERT_EQ(own.parameters.size(), 2u);
  double corrected = 0.0, as_found = 0.0;
  for (std::size_t i = 0; i < own.records.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    corrected = std::max(corrected, std::abs(own.values.theta(row, 0) / kViscous - 1.0));
    const auto& one = own.parameters[0]->per_experiment[i];
    if (one.value) as_found = std::max(as_found, std::abs(*one.value / kViscous - 1.0));
  }
  EXPECT_EQ(own.parameters[0]->parameter, "coefficient");
  EXPECT_GT(as_found, 2.0 * corrected);
  EXPECT_LT(corrected, 0.15);
}

}  // namespace
}  // namespace flexspline::selection::selection_record_inertia_test
