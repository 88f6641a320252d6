// Parameters that show on two torque balances, against one least-squares fit of both together.
#include "host/engine/estimation/evidence.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace flexspline::estimation::estimation_evidence_test {
namespace {

// y = X a + Z b + noise, where b is asked for on both balances and a is each one's own.
struct Balance {
  Eigen::MatrixXd own, shared;
  Eigen::VectorXd y;
  double noise = 1.0;
};

Balance balance(std::mt19937& random, Eigen::Index rows, const Eigen::VectorXd& b, double noise) {
  std::normal_distribution<double> normal;
  const auto fill = [&](Eigen::MatrixXd m) { return m.unaryExpr([&](double) { return normal(random); }).eval(); };
  Balance made{fill(Eigen::MatrixXd(rows, 3)), fill(Eigen::MatrixXd(rows, b.size())), {}, noise};
  made.shared.col(0) += 2.0 * made.own.col(1);  // what is shared is partly collinear with its own
  made.y = made.own * Eigen::Vector3d(0.3, -2.0, 5.0) + made.shared * b + noise * fill(Eigen::MatrixXd(rows, 1));
  return made;
}

struct Whole {
  Eigen::VectorXd b;
  Eigen::MatrixXd covariance;
  double squares = 0.0;
};
// All balances at once, by the normal equations.
Whole fit(const std::vector<Balance>& balances, Eigen::Index shared) {
  Eigen::Index rows = 0;
  for (const Balance& one : balances) rows += one.y.size();
  const auto own = static_cast<Eigen::Index>(3 * balances.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(rows, own + shared);
  Eigen::VectorXd y(rows);
  for (Eigen::Index i = 0, at = 0; i < static_cast<Eigen::Index>(balances.size()); ++i) {
    const Balance& one = balances[static_cast<std::size_t>(i)];
    A.block(at, 3 * i, one.y.size(), 3) = one.own / one.noise;
    A.block(at, own, one.y.size(), shared) = one.shared / one.noise;
    y.segment(at, one.y.size()) = one.y / one.noise;
    at += one.y.size();
  }
  const Eigen::MatrixXd inverse = (A.transpose() * A).inverse();
  const Eigen::VectorXd theta = inverse * A.transpose() * y;
  return {theta.tail(shared), inverse.bottomRightCorner(shared, shared), (y - A * theta).squaredNorm()};
}

TEST(CombinedEvidence, IsWhatOneFitOfBothWouldFind) {
  std::mt19937 random(5);
  for (int round = 0; round < 50; ++round) {
    const Eigen::Vector2d b(1.5, -0.7);
    const Balance own = balance(random, 200, b, 0.3), other = balance(random, 80, b, 0.05);
    const Whole alone = fit({own}, 2), both = fit({own, other}, 2), there = fit({other}, 2);
    const ScoreAndInformation evidence =
        score_and_information(other.shared, other.own, other.y - other.shared * alone.b,
                              Eigen::VectorXd(Eigen::VectorXd::Constant(other.y.size(), 1.0 / other.noise)), 1.0);
    const CombinedEstimate found = combine(scaled_inverse(alone.covariance), evidence);
    EXPECT_LT((alone.b + found.change - both.b).norm(), 1e-9 * both.b.norm());
    EXPECT_LT((found.covariance - both.covariance).norm(), 1e-9 * both.covariance.norm());
    // What the move costs on their own balance, with what it leaves on the other one, are the squares of the fit of
    // both.
    Eigen::VectorXd left = other.y - other.shared * (alone.b + found.change);
    left -= other.own * (other.own.transpose() * other.own).inverse() * other.own.transpose() * left;
    EXPECT_NEAR(alone.squares + found.cost + left.squaredNorm() / (other.noise * other.noise), both.squares,
                1e-9 * both.squares);
    EXPECT_GT(both.squares, alone.squares + there.squares);
  }
}

TEST(CombinedEvidence, ABalanceThatDoesNotShowTheParametersChangesNothing) {
  std::mt19937 random(6);
  const Eigen::Vector2d b(1.0, 2.0);
  const Balance own = balance(random, 100, b, 0.1), other = balance(random, 100, b, 0.1);
  const Whole alone = fit({own}, 2);
  const ScoreAndInformation evidence = score_and_information(Eigen::MatrixXd::Zero(100, 2), other.own, other.y,
                                                             Eigen::VectorXd(Eigen::VectorXd::Ones(100)), 1.0);
  const CombinedEstimate found = combine(scaled_inverse(alone.covariance), evidence);
  EXPECT_EQ(found.change.norm(), 0.0);
  EXPECT_EQ(found.cost, 0.0);
  EXPECT_LT((found.covariance - alone.covariance).norm(), 1e-9 * alone.covariance.norm());
}

TEST(CombinedEvidence, RowsThatGoTogetherCountAsOne) {
  std::mt19937 random(7);
  const Eigen::Vector2d b(1.0, 2.0);
  const Balance other = balance(random, 100, b, 0.1);
  const Eigen::VectorXd weights = Eigen::VectorXd::Constant(100, 10.0);
  const ScoreAndInformation once = score_and_information(other.shared, other.own, other.y, weights, 1.0);
  const ScoreAndInformation together = score_and_information(other.shared, other.own, other.y, weights, 4.0);
  EXPECT_LT((once.score - 4.0 * together.score).norm(), 1e-9 * once.score.norm());
  EXPECT_LT((once.information - 4.0 * together.information).norm(), 1e-9 * once.information.norm());
}

TEST(CombinedEvidence, ParametersOfVeryDifferentSizeAreInvertedWell) {
  const Eigen::Vector2d scale(1e-9, 1e6);
  Eigen::Matrix2d correlation;
  correlation << 1.0, 0.9, 0.9, 1.0;
  const Eigen::MatrixXd covariance = scale.asDiagonal() * correlation * scale.asDiagonal();
  const Eigen::MatrixXd product =
      scale.cwiseInverse().asDiagonal() * covariance * scaled_inverse(covariance) * scale.asDiagonal();
  EXPECT_LT((product - Eigen::Matrix2d::Identity()).norm(), 1e-12);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_evidence_test
