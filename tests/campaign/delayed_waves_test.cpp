// Ripples with a delay, which compete with friction over the angle: torques that are written down.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <string>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/candidate_tables.hpp"
#include "host/engine/selection/policy.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::delayed_waves_test {
namespace {

using data::Column;

// The regressor table of an axis with a ripple of order 2 that follows the angle by 5 ms.
RegressorTable table_of_late_ripple() {
  const data::Dataset dataset =
      tests::written_dataset({0.5, 1.0}, 4e-3, 6000, [](double rate, double t, data::Experiment& e) {
        const double w = 20.0 * std::sin(rate * t), q = 20.0 / rate * (1.0 - std::cos(rate * t));
        e[Column::motor_position].push_back(q);
        e[Column::motor_torque].push_back(2e-3 * rate * std::cos(rate * t) + 3e-4 * w + 0.02 * (w > 0.0 ? 1.0 : -1.0) +
                                          0.01 * std::cos(2.0 * (q - 5e-3 * w) - 0.7));
      });
  const auto fitted = estimation::identify(dataset, tests::plain_model(), {});
  const std::vector<const data::Experiment*> all = {&dataset.experiments[0], &dataset.experiments[1]};
  return make_tables(all, fitted->model.drive, fitted->terms, Balance::motor, kPolicy).table;
}

// Squares that the model and one term leave away from reversals.
double left_with(const RegressorTable& table, const CandidateTerm& term) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index j = 0; j < table.model_columns; ++j) columns.push_back(j);
  columns.insert(columns.end(), term.columns.begin(), term.columns.end());
  const Eigen::VectorXd keep = (table.velocity_over_noise.array().abs() > 30.0).cast<double>();
  const Eigen::MatrixXd X = keep.asDiagonal() * table.columns(Eigen::all, columns);
  const Eigen::VectorXd y = keep.cwiseProduct(table.target);
  return (y - X * X.colPivHouseholderQr().solve(y)).squaredNorm();
}

const CandidateTerm* find(const RegressorTable& table, const std::string& name, bool is_delayed) {
  for (const CandidateTerm& term : table.terms)
    if (term.name == name && term.is_delayed == is_delayed) return &term;
  return nullptr;
}

TEST(DelayedWaves, OfARippleCompeteWithEachOrderOfFrictionOverTheAngle) {
  const RegressorTable table = table_of_late_ripple();
  int orders = 0;
  for (const CandidateTerm& term : table.terms) {
    if (!term.entry || term.entry->name() != "angle_dependent_friction" || *term.order < 1.0) continue;
    ++orders;
    const std::string ripple = "torque_ripple" + term.name.substr(term.name.find(':'));
    ASSERT_NE(find(table, ripple, false), nullptr) << ripple;
    ASSERT_NE(find(table, ripple, true), nullptr) << ripple;
    EXPECT_EQ(find(table, ripple, true)->columns.size(), 4U);
    EXPECT_EQ(find(table, term.name, true), nullptr) << "friction has none";
  }
  EXPECT_GT(orders, 0);
}

TEST(DelayedWaves, FollowARippleThatIsLateBetterThanOneThatIsNot) {
  const RegressorTable table = table_of_late_ripple();
  const CandidateTerm *const plain = find(table, "torque_ripple:2", false), *const delayed =
                                                                                find(table, "torque_ripple:2", true);
  ASSERT_NE(plain, nullptr);
  ASSERT_NE(delayed, nullptr);
  // Of a delay of 0.2 rad at most the second order is left.
  EXPECT_LT(left_with(table, *delayed), 0.1 * left_with(table, *plain));
}

}  // namespace
}  // namespace flexspline::selection::delayed_waves_test
