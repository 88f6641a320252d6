// A penalised curve against its closed form with dense matrices.
#include "host/engine/estimation/smooth_curve.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <random>

namespace flexspline::estimation::smooth_curve_test {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Rows at random places of an interval (or a turn), with hat functions written once more.
struct Made {
  CurveProblem problem;
  Vector x;
};

Matrix hats(const Vector& x, Eigen::Index points, bool closed) {
  Matrix columns = Matrix::Zero(x.size(), points);
  const double step = closed ? 1.0 / static_cast<double>(points) : 1.0 / static_cast<double>(points - 1);
  for (Eigen::Index k = 0; k < x.size(); ++k)
    for (Eigen::Index j = 0; j < points; ++j) {
      double distance = std::abs(x[k] - static_cast<double>(j) * step);
      if (closed) distance = std::min(distance, 1.0 - distance);
      columns(k, j) = std::max(0.0, 1.0 - distance / step);
    }
  return columns;
}

template <class Law>
Made made(Eigen::Index rows, Eigen::Index points, double noise, Law law, unsigned seed, bool closed = false) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> normal;
  Made m;
  m.x.resize(rows);
  for (double& x : m.x) x = unit(random);
  m.problem.points = hats(m.x, points, closed);
  m.problem.others.resize(rows, 0);
  m.problem.target.resize(rows);
  for (Eigen::Index k = 0; k < rows; ++k) m.problem.target[k] = law(m.x[k]) + noise * normal(random);
  m.problem.root_weights = Vector::Ones(rows);
  for (Eigen::Index k = 0; k < rows; ++k) m.problem.fold.push_back(static_cast<int>(k % 5));
  m.problem.closed = closed;
  return m;
}

double bump(double x) {
  return std::exp(-std::pow((x - 0.4) / 0.08, 2.0));
}

TEST(SmoothCurve, IsTheClosedFormOfThePenalisedLeastSquares) {
  for (const bool closed : {false, true}) {
    Made m = made(400, 24, 0.1, bump, 3, closed);
    std::mt19937 random(4);
    std::normal_distribution<double> normal;
    m.problem.others.resize(400, 2);  // nothing that a curve over x could draw
    for (double& v : m.problem.others.reshaped()) v = normal(random);
    m.problem.target += m.problem.others * Eigen::Vector2d(3.0, -2.0);
    for (Eigen::Index k = 0; k < 400; ++k) m.problem.root_weights[k] = 0.5 + 1.0 * static_cast<double>(k % 3);
    const double smoothing = 2.5;
    const Curve curve = fit_curve_smoothed(m.problem, smoothing);
    Matrix A(400, 26);
    A << m.problem.others, m.problem.points;
    Matrix d = Matrix::Zero(closed ? 24 : 22, 26);
    for (Eigen::Index k = 0; k < d.rows(); ++k) {
      d(k, 2 + k) += 1.0;
      d(k, 2 + (k + 1) % 24) += -2.0;
      d(k, 2 + (k + 2) % 24) += 1.0;
    }
    const Vector w2 = m.problem.root_weights.cwiseAbs2();
    const Matrix normal_matrix = A.transpose() * w2.asDiagonal() * A + smoothing * d.transpose() * d;
    const Matrix inverse = normal_matrix.fullPivLu().inverse();
    const Vector expected = inverse * (A.transpose() * w2.asDiagonal() * m.problem.target);
    EXPECT_LT((curve.beta - expected.head(2)).norm(), 1e-8);
    EXPECT_LT((curve.value - expected.tail(24)).norm(), 1e-6);
    // Effective numbers of the curve and the covariance, from the hat matrix.
    const Matrix hat = inverse * (A.transpose() * w2.asDiagonal() * A);
    EXPECT_NEAR(curve.effective_degrees_of_freedom, hat.diagonal().tail(24).sum(), 1e-5);
    const Vector residual = m.problem.target - A * expected;
    const double noise = residual.dot(w2.cwiseProduct(residual)) / (400.0 - 2.0 - curve.effective_degrees_of_freedom);
    EXPECT_LT((curve.covariance - noise * inverse.bottomRightCorner(24, 24)).norm(), 1e-5 * curve.covariance.norm());
    EXPECT_TRUE(curve.left_to.empty());
  }
}

TEST(SmoothCurve, LeftOutSquaresAreThoseOfFitsWithoutEachFold) {
  const Made m = made(300, 16, 0.2, bump, 5);
  const double smoothing = 1.0;
  const Curve curve = fit_curve_smoothed(m.problem, smoothing);
  const Matrix d = second_differences(16, false);
  double sum = 0.0;
  for (int f = 0; f < 5; ++f) {
    std::vector<Eigen::Index> in, out;
    for (Eigen::Index k = 0; k < 300; ++k) (k % 5 == f ? out : in).push_back(k);
    const Matrix A = m.problem.points(in, Eigen::all);
    const Vector t =
        (A.transpose() * A + smoothing * d.transpose() * d).fullPivLu().solve(A.transpose() * m.problem.target(in));
    sum += (m.problem.target(out) - m.problem.points(out, Eigen::all) * t).squaredNorm();
  }
  EXPECT_NEAR(curve.squares_with, sum, 1e-6 * sum);
  EXPECT_NEAR(curve.squares_without, m.problem.target.squaredNorm(), 1e-9 * sum);
}

TEST(SmoothCurve, SmoothsAStraightLineToTwoNumbersAndABumpToAsManyAsItHas) {
  const auto effective = [](auto law, double noise) {
    return fit_curve(made(2000, 64, noise, law, 9).problem).effective_degrees_of_freedom;
  };
  EXPECT_LT(effective([](double x) { return 2.0 * x - 1.0; }, 0.3), 4.0);
  EXPECT_GT(effective(bump, 0.05), 10.0);
  EXPECT_GT(effective(bump, 0.01), effective(bump, 0.3));
}

TEST(SmoothCurve, IntervalsCoverTheTruth) {
  int covered = 0, all = 0;
  for (unsigned seed = 1101; seed < 1161; ++seed) {
    const Curve curve = fit_curve(made(1500, 33, 0.3, bump, seed).problem);
    for (Eigen::Index j = 0; j < 33; ++j) {
      const double truth = bump(static_cast<double>(j) / 32.0);
      covered += std::abs(curve.value[j] - truth) < 1.96 * std::sqrt(curve.covariance(j, j)) ? 1 : 0;
      ++all;
    }
  }
  const double share = static_cast<double>(covered) / all;
  RecordProperty("coverage_percent", static_cast<int>(100.0 * share));
  EXPECT_GT(share, 0.88);
  EXPECT_LT(share, 0.99);
}

TEST(SmoothCurve, AFoldWithoutAnyWeightChangesNothing) {
  Made m = made(400, 24, 0.1, bump, 3);
  Made without = m;
  for (Eigen::Index k = 0; k < 400; ++k) {
    const bool last = k % 5 == 4;
    m.problem.root_weights[k] = without.problem.root_weights[k] = last ? 0.0 : 1.0;
    if (last) without.problem.fold[static_cast<std::size_t>(k)] = 0;  // no fold is empty of weight then
  }
  without.problem.folds = 4;
  const Curve curve = fit_curve(m.problem);
  const Curve expected = fit_curve(without.problem);
  EXPECT_TRUE(curve.value.isApprox(expected.value, 1e-9));
  EXPECT_NEAR(curve.squares_with, expected.squares_with, 1e-9 * expected.squares_with);
}

TEST(SmoothCurve, LeavesToTheOthersWhatTheyDrawThemselves) {
  Made m = made(
      2000, 32, 0.05, [](double x) { return 3.0 + 2.0 * x + bump(x); }, 6);
  m.problem.others.resize(2000, 2);
  m.problem.others.col(0).setOnes();
  m.problem.others.col(1) = m.x;
  const Curve curve = fit_curve(m.problem);
  ASSERT_EQ(curve.left_to.size(), 2U);
  const Vector torque = m.problem.points * curve.value;
  EXPECT_LT(std::abs(torque.sum()), 1e-6 * torque.norm() * std::sqrt(2000.0));
  EXPECT_LT(std::abs(torque.dot(m.x)), 1e-6 * torque.norm() * m.x.norm());
  // The whole is what matters: line and curve together are the truth.
  double worst = 0.0;
  for (Eigen::Index k = 0; k < 2000; ++k)
    worst = std::max(
        worst, std::abs(curve.beta[0] + curve.beta[1] * m.x[k] + torque[k] - (3.0 + 2.0 * m.x[k] + bump(m.x[k]))));
  EXPECT_LT(worst, 0.06);
}

TEST(SmoothCurve, DoesNotLowerLeftOutSquaresWhereThereIsNothing) {
  int worse = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Curve curve = fit_curve(made(
                                      600, 32, 1.0, [](double) { return 0.0; }, seed)
                                      .problem);
    const double fall = 1.0 - curve.squares_with / curve.squares_without;
    EXPECT_LT(fall, 0.03);
    worse += fall <= 0.0 ? 1 : 0;
  }
  EXPECT_GT(worse, 8);
}

TEST(SmoothCurve, DrawsOnFromNeighboursWhereNoRowLies) {
  Made m = made(
      1000, 21, 0.01, [](double x) { return 2.0 * x; }, 2);
  for (Eigen::Index k = 0; k < 1000; ++k)
    if (m.x[k] > 0.5) m.problem.root_weights[k] = 0.0;
  const Curve curve = fit_curve(m.problem);
  EXPECT_NEAR(curve.value[20], 2.0, 0.2);
  EXPECT_GT(curve.covariance(20, 20), 30.0 * curve.covariance(5, 5));
}

}  // namespace
}  // namespace flexspline::estimation::smooth_curve_test
