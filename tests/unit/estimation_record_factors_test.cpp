// R factors of records and of their parts, against the rows that they stand for.
#include "host/engine/estimation/record_factors.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "host/engine/estimation/random_effects.hpp"

namespace flexspline::estimation::estimation_record_factors_test {
namespace {

using data::Column;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kParts = 5;

// Two records whose rows are taken for a regression with columns that are drawn, and a few rows that do not count.
struct Bench {
  std::vector<data::Experiment> experiments{record(0.7, 3000), record(1.3, 2000)};
  PreparedData prepared = prepare({&experiments[0], &experiments[1]}, {}, {40.0, false});
  RegressionProblem data{prepared, Balance::motor};
  MatrixXd X = MatrixXd(data.rows(), 3);
  VectorXd y = VectorXd(data.rows()), keep = VectorXd::Ones(data.rows());

  Bench() {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    for (double& x : X.reshaped()) x = normal(random);
    X.col(2) *= 1e6;  // parameters differ in size by their units
    for (double& v : y) v = normal(random);
    keep.segment(10, 7).setZero();
  }
  static data::Experiment record(double frequency_hz, std::size_t samples) {
    data::Experiment e;
    e.name = std::to_string(frequency_hz);
    e.sample_s = 1e-3;
    for (std::size_t k = 0; k < samples; ++k) {
      const double t = 1e-3 * static_cast<double>(k);
      e.time_s.push_back(t);
      e[Column::motor_position].push_back(std::sin(6.283185307179586 * frequency_hz * t));
      e[Column::motor_torque].push_back(std::cos(6.283185307179586 * frequency_hz * t));
    }
    e.segments = {{0, samples}};
    return e;
  }
  // [X/size, y] of rows that count.
  MatrixXd rows(const RecordFactors& factors, const RowRange& range) const {
    MatrixXd all(range.size(), 4);
    all << X.middleRows(range.first, range.size()) * factors.size.cwiseInverse().asDiagonal(),
        y.segment(range.first, range.size());
    return keep.segment(range.first, range.size()).asDiagonal() * all;
  }
};

TEST(RecordFactorsOf, HaveTheCrossProductsOfTheirRows) {
  const Bench bench;
  const RecordFactors factors = record_factors(bench.data, bench.X, bench.y, bench.keep, kParts);
  ASSERT_EQ(factors.whole.size(), 2U);
  EXPECT_EQ(factors.rows_of(0) + factors.rows_of(1), bench.keep.sum());
  const auto folds = bench.data.folds(kParts);
  for (std::size_t i = 0; i < 2; ++i) {
    const MatrixXd record = bench.rows(factors, bench.data.records()[i]);
    EXPECT_LT((factors.whole[i].transpose() * factors.whole[i] - record.transpose() * record).norm(),
              1e-10 * record.squaredNorm());
    for (std::size_t part = 0; part < kParts; ++part) {
      const MatrixXd rows = bench.rows(factors, folds[part][i]);
      const MatrixXd& factor = factors.parts[i][part];
      EXPECT_LT((factor.transpose() * factor - rows.transpose() * rows).norm(), 1e-10 * rows.squaredNorm());
      EXPECT_EQ(MatrixXd(factor.triangularView<Eigen::StrictlyLower>()).norm(), 0.0);
    }
  }
  EXPECT_LT((factors.size - (bench.keep.asDiagonal() * bench.X).colwise().norm().transpose()).norm(), 1e-3);
}

TEST(RecordFactorsOf, FitAnyPartsAsTheirRowsWouldWithoutSquaringTheConditionNumber) {
  const Bench bench;
  const RecordFactors factors = record_factors(bench.data, bench.X, bench.y, bench.keep, kParts);
  const auto folds = bench.data.folds(kParts);
  std::vector<const MatrixXd*> chosen;
  MatrixXd rows(0, 4);
  for (const auto& [record, part] : {std::pair{0U, 1U}, {0U, 4U}, {1U, 2U}}) {
    chosen.push_back(&factors.parts[record][part]);
    const MatrixXd more = bench.rows(factors, folds[part][record]);
    rows.conservativeResize(rows.rows() + more.rows(), Eigen::NoChange);
    rows.bottomRows(more.rows()) = more;
  }
  const MatrixXd factor = combined_factor(chosen);
  const VectorXd theta = factor.topLeftCorner(3, 3).triangularView<Eigen::Upper>().solve(factor.col(3).head(3));
  const VectorXd dense = rows.leftCols(3).colPivHouseholderQr().solve(rows.col(3));
  EXPECT_LT((theta - dense).norm(), 1e-10 * dense.norm());
  EXPECT_NEAR(std::abs(factor(3, 3)), (rows.col(3) - rows.leftCols(3) * dense).norm(), 1e-10 * rows.col(3).norm());
}

TEST(MixedModel, WithoutRandomEffectsIsLeastSquaresWeighedByTheNoiseOfEachRecord) {
  Bench bench;
  const VectorXd truth = (VectorXd(3) << 1.0, -2.0, 3e-6).finished();
  for (std::size_t i = 0; i < 2; ++i) {
    const RowRange& range = bench.data.records()[i];
    bench.y.segment(range.first, range.size()) = bench.X.middleRows(range.first, range.size()) * truth +
                                                 (i == 0 ? 0.1 : 1.0) * bench.y.segment(range.first, range.size());
  }
  const RecordFactors factors = record_factors(bench.data, bench.X, bench.y, bench.keep, 1);
  const MixedFit fit = fit_mixed_model(factors, {}, 3, 1.0);
  MatrixXd normal = MatrixXd::Zero(3, 3);
  VectorXd right = VectorXd::Zero(3);
  for (std::size_t i = 0; i < 2; ++i) {
    const MatrixXd rows = bench.rows(factors, bench.data.records()[i]);
    normal += rows.leftCols(3).transpose() * rows.leftCols(3) / fit.effects.variance[i];
    right += rows.leftCols(3).transpose() * rows.col(3) / fit.effects.variance[i];
  }
  EXPECT_LT((fit.linear.theta - normal.ldlt().solve(right)).norm(), 1e-8 * fit.linear.theta.norm());
  EXPECT_NEAR(std::sqrt(fit.effects.variance[0]), 0.1, 0.01);
  EXPECT_NEAR(std::sqrt(fit.effects.variance[1]), 1.0, 0.1);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_record_factors_test
