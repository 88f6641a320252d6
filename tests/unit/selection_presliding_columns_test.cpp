// What a regressor table has in the place of columns where a state of presliding takes that of the sign of the
// velocity.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <random>

#include "host/engine/selection/filtered_table.hpp"
#include "host/engine/selection/halves.hpp"

namespace flexspline::selection::selection_presliding_columns_test {
namespace {

// Columns of a table: two of the model, one that differs with the state of presliding, and two of its shape.
struct WithPresliding {
  RegressorTable table;
  Eigen::MatrixXd sign, presliding;  // samples of a fit with either: columns in their places, the target last
};
WithPresliding table_with_presliding(unsigned seed) {
  constexpr Eigen::Index kRows = 400;
  std::mt19937_64 chance(seed);
  std::normal_distribution<double> normal;
  const auto random = [&](Eigen::Index columns) -> Eigen::MatrixXd {
    return Eigen::MatrixXd::NullaryExpr(kRows, columns, [&] { return normal(chance); });
  };
  WithPresliding w;
  RegressorTable& t = w.table;
  t.records = 2;
  t.held_out = {0, 0};
  t.highest_hz = 30.0;
  t.model_columns = 2;
  t.model_low = {-effects::kUnbounded, -effects::kUnbounded};
  t.columns = random(3);
  t.scale = Eigen::VectorXd::Ones(3);
  t.target = random(1);
  t.runs = {{0, 0, kRows / 2, 8e-3}, {1, kRows / 2, kRows, 8e-3}};
  t.velocity_over_noise = Eigen::VectorXd::Constant(kRows, 100.0);
  CandidateTerm term;
  term.name = "term";
  term.columns = {2};
  term.low = {-effects::kUnbounded};
  t.terms = {term};
  t.presliding = PreslidingColumns{{1}, random(3), random(1)};
  w.sign.resize(kRows, 4);
  w.sign << t.columns, t.target;
  w.presliding.resize(kRows, 6);
  w.presliding << t.columns.col(0), t.presliding->columns.col(0), t.columns.col(2), t.presliding->columns.rightCols(2),
      t.presliding->target;
  return w;
}

TEST(PreslidingColumns, TakeThePlacesOfThoseThatDifferInProductsAndHalves) {
  const WithPresliding w = table_with_presliding(31);
  SelectionPolicy policy;
  // At the bandwidth of the table nothing is filtered; all samples but those at the ends are taken.
  const Setting setting = make_setting(filtered_table(w.table, all_columns(w.table), w.table.highest_hz),
                                       all_columns(w.table), false, false, policy);
  ASSERT_EQ(setting.sign_width, 4);
  ASSERT_EQ(setting.presliding.size(), 6U);
  const std::vector<double> weights = {2.0, 0.5};
  const std::vector<std::vector<std::uint8_t>> in = {std::vector<std::uint8_t>(setting.blocks.size(), 0)};
  std::vector<std::vector<std::uint8_t>> odd = in;
  for (std::size_t b = 0; b < odd[0].size(); b += 2) odd[0][b] = 1;
  const HalfPair pair = halves_of(setting, weights, odd, {}).front();
  Eigen::MatrixXd sign = Eigen::MatrixXd::Zero(4, 4), presliding = Eigen::MatrixXd::Zero(6, 6);
  for (const auto& run : setting.runs) {
    Eigen::MatrixXd own(run.last - run.first, 6);
    for (Eigen::Index place = 0; place < 6; ++place)
      own.col(place) = setting.column(place, Direction::presliding).segment(run.first, run.last - run.first);
    presliding += weights[run.record] * own.transpose() * own;
    const Eigen::MatrixXd other = setting.rows.middleRows(run.first, run.last - run.first).leftCols(4);
    sign += weights[run.record] * other.transpose() * other;
  }
  EXPECT_LT((pair[0].sign + pair[1].sign - sign).norm(), 1e-10 * sign.norm());
  EXPECT_LT((pair[0].presliding + pair[1].presliding - presliding).norm(), 1e-10 * presliding.norm());
  // A sample of the setting is a sample of the table.
  const Eigen::VectorXd first = setting.rows.row(0).leftCols(4);
  Eigen::Index at = 0;
  (w.sign.rowwise() - first.transpose()).rowwise().squaredNorm().minCoeff(&at);
  EXPECT_LT((w.sign.row(at).transpose() - first).norm(), 1e-12);
  for (Eigen::Index place = 0; place < 6; ++place)
    EXPECT_EQ(setting.column(place, Direction::presliding)[0], w.presliding(at, place)) << place;
}

TEST(PreslidingColumns, StayWithTheTermsThatAreKept) {
  const WithPresliding w = table_with_presliding(32);
  const ChosenColumns none = choose_columns(w.table, {});
  ASSERT_TRUE(none.table.presliding);
  EXPECT_EQ(none.table.presliding->instead_of, std::vector<Eigen::Index>{1});
  EXPECT_EQ(none.presliding, (std::vector<Eigen::Index>{0, 1, 2}));
  EXPECT_EQ(none.table.presliding_shape(), (std::vector<Eigen::Index>{2, 3}));
  EXPECT_FALSE(choose_columns(w.table, {0}, false).table.presliding);
}

// Bristles in parallel hold forces of one sign: of all subsets of the shape's columns the best one whose coefficients
// are not negative.
TEST(PreslidingColumns, OfTheShapeHaveNoNegativeForces) {
  std::size_t dropped = 0;
  for (unsigned seed = 41; seed < 71; ++seed) {
    const WithPresliding w = table_with_presliding(seed);
    const HalfData all{w.sign.transpose() * w.sign, w.presliding.transpose() * w.presliding,
                       static_cast<double>(w.sign.rows())};
    const TermFit fitted = fit_terms(w.table, {kPreslidingTerm}, all, all);
    const Eigen::VectorXd y = w.presliding.col(5);
    double best = 1e300;
    for (const std::vector<Eigen::Index>& shape : std::vector<std::vector<Eigen::Index>>{{}, {3}, {4}, {3, 4}}) {
      std::vector<Eigen::Index> columns = {0, 1};
      columns.insert(columns.end(), shape.begin(), shape.end());
      const Eigen::MatrixXd X = w.presliding(Eigen::all, columns);
      const Eigen::VectorXd theta = X.colPivHouseholderQr().solve(y);
      if (shape.empty() || theta.tail(std::ssize(shape)).minCoeff() >= 0.0)
        best = std::min(best, (y - X * theta).squaredNorm());
    }
    EXPECT_NEAR(fitted.training_squares, best, 1e-5 * best) << seed;
    dropped += fitted.columns.size() < 4U ? 1 : 0;
  }
  EXPECT_GT(dropped, 10U);
  EXPECT_LT(dropped, 30U);
}

}  // namespace
}  // namespace flexspline::selection::selection_presliding_columns_test
