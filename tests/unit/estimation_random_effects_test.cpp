// Friction that differs from run to run, against dense covariance matrices and drawn random effects.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <set>
#include <string_view>

#include "host/engine/estimation/noise_covariance.hpp"
#include "host/engine/estimation/random_effects.hpp"

namespace flexspline::estimation::estimation_random_effects_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Records of random columns, of which the second and third are two friction groups whose torque differs by a factor.
struct Bench {
  std::mt19937_64 random;
  std::normal_distribution<double> normal;
  std::vector<MatrixXd> X;
  std::vector<VectorXd> y;
  VectorXd theta = (VectorXd(4) << 1.0, 2.0, 3.0, -1.0).finished();
  MatrixXd u = MatrixXd::Zero(4, 2);
  std::vector<SmallVector> factor;
  std::vector<double> noise;

  Bench(unsigned seed, std::size_t records, Eigen::Index rows, double first, double second) : random(seed) {
    u(1, 0) = theta[1];
    u(2, 1) = theta[2];
    for (std::size_t i = 0; i < records; ++i) {
      X.emplace_back(rows, 4);
      for (double& x : X.back().reshaped()) x = normal(random);
      factor.push_back((SmallVector(2) << first * normal(random), second * normal(random)).finished());
      noise.push_back(0.1 * (1.0 + static_cast<double>(i % 3)));
      y.push_back(X.back() * (theta + u * factor.back()));
      for (double& v : y.back()) v += noise.back() * normal(random);
    }
  }
  MatrixXd factor_of(std::size_t i) const {
    MatrixXd all(X[i].rows(), 5);
    all << X[i], y[i];
    return combined_factor(std::vector<const MatrixXd*>{&all});
  }
  std::vector<RecordErrors> errors(const VectorXd& at) const {
    std::vector<RecordErrors> list(X.size());
    for (std::size_t i = 0; i < X.size(); ++i)
      add_errors(factor_of(i), at, u, static_cast<double>(X[i].rows()), list[i]);
    return list;
  }
  MatrixXd covariance(std::size_t i, const SmallVector& std, double variance) const {
    const MatrixXd z = X[i] * u * std.asDiagonal();
    return variance * MatrixXd::Identity(X[i].rows(), X[i].rows()) + z * z.transpose();
  }
};

TEST(EliminateRandomEffects, LeavesTheFitOfGeneralisedLeastSquaresWithTheDenseCovariance) {
  const Bench bench(1, 5, 40, 0.2, 0.1);
  const SmallVector std = (SmallVector(2) << 0.2, 0.1).finished();
  MatrixXd normal = MatrixXd::Zero(4, 4);
  VectorXd right = VectorXd::Zero(4);
  std::vector<MatrixXd> reduced;
  for (std::size_t i = 0; i < bench.X.size(); ++i) {
    const double variance = bench.noise[i] * bench.noise[i];
    const MatrixXd inverse = bench.covariance(i, std, variance).inverse();
    normal += bench.X[i].transpose() * inverse * bench.X[i];
    right += bench.X[i].transpose() * inverse * bench.y[i];
    reduced.push_back(eliminate_random_effects(bench.factor_of(i), bench.u, std, variance));
  }
  const MatrixXd all = combined_factor(reduced);
  const VectorXd dense = normal.ldlt().solve(right);
  const VectorXd ours = all.topLeftCorner(4, 4).triangularView<Eigen::Upper>().solve(all.col(4).head(4));
  EXPECT_LT((ours - dense).norm(), 1e-10);
  EXPECT_LT((all.leftCols(4).transpose() * all.leftCols(4) - normal).norm(), 1e-9 * normal.norm());
  double chi2 = 0.0;
  for (std::size_t i = 0; i < bench.X.size(); ++i) {
    const VectorXd e = bench.y[i] - bench.X[i] * dense;
    chi2 += e.dot(bench.covariance(i, std, bench.noise[i] * bench.noise[i]).ldlt().solve(e));
  }
  EXPECT_NEAR((all.col(4) - all.leftCols(4) * ours).squaredNorm(), chi2, 1e-8 * chi2);
}

TEST(RandomEffectsAt, HasTheLikelihoodOfTheDenseCovariance) {
  const Bench bench(2, 4, 60, 0.1, 0.05);
  const SmallVector std = (SmallVector(2) << 0.1, 0.05).finished();
  const std::vector<RecordErrors> errors = bench.errors(bench.theta);
  const RandomEffects effects = random_effects_at(errors, std, 1.0, 0.0);
  for (std::size_t i = 0; i < bench.X.size(); ++i) {
    const VectorXd e = bench.y[i] - bench.X[i] * bench.theta;
    const MatrixXd V = bench.covariance(i, std, effects.variance[i]);
    const Eigen::LLT<MatrixXd> llt(V);
    const double one = e.dot(llt.solve(e));
    const double log_det = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
    // Noise at its own best value leaves as many squares as rows.
    EXPECT_NEAR(effects.deviance[i] + errors[i].rows, log_det + one, 1e-3 * errors[i].rows) << i;
  }
}

TEST(FitRandomEffects, FindsTheStandardDeviationsThePredictionsAndTheNoiseThatWereDrawn) {
  const Bench bench(3, 300, 80, 0.03, 0.0);
  const RandomEffects effects = fit_random_effects(bench.errors(bench.theta), 1.0, 0.0);
  EXPECT_NEAR(effects.std[0], 0.03, 0.004) << "three standard errors of 300 draws";
  EXPECT_LT(effects.std[1], 0.006);
  double error = 0.0, size = 0.0;
  for (std::size_t i = 0; i < bench.X.size(); ++i) {
    error += std::pow(effects.predictions[i][0] - bench.factor[i][0], 2);
    size += std::pow(bench.factor[i][0], 2);
    EXPECT_NEAR(std::sqrt(effects.variance[i]) / bench.noise[i], 1.0, 0.35);
  }
  EXPECT_LT(error, 0.3 * size);
}

TEST(FitRandomEffects, TwoRecordsIdentifyNone) {
  const Bench bench(4, 2, 80, 0.3, 0.3);
  const RandomEffects effects = fit_random_effects(bench.errors(bench.theta), 1.0, 0.0);
  EXPECT_EQ(effects.std[0], 0.0);
  EXPECT_EQ(effects.std[1], 0.0);
}

TEST(FitRandomEffects, RowsThatAreAlikeCountForLess) {
  // With rows in threes that are the same, a third of them count: the likelihood of the distinct ones.
  Bench once(5, 40, 60, 0.05, 0.0), thrice = once;
  for (std::size_t i = 0; i < once.X.size(); ++i) {
    thrice.X[i] = once.X[i].replicate(3, 1);
    thrice.y[i] = once.y[i].replicate(3, 1);
  }
  const RandomEffects one = fit_random_effects(once.errors(once.theta), 1.0, 0.0);
  const RandomEffects three = fit_random_effects(thrice.errors(once.theta), 3.0, 0.0);
  EXPECT_NEAR(three.std[0] / one.std[0], 1.0, 1e-6);
  EXPECT_NEAR(three.deviance[0], one.deviance[0], 1e-6 * std::abs(one.deviance[0]));
}

TEST(FrictionGroups, LawsOfTheSameSurfaceAreOne) {
  const auto term = [](const char* name) { return candidate_term(catalogue::get(name)); };
  const Terms terms{term("inertia"), term("viscous_friction"), term("coulomb_friction"), term("gravity")};
  const std::vector<FrictionGroup> groups = friction_groups(terms, free_linear_parameters(terms, {0, 1, 2, 3}));
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].name, "viscous friction");
  EXPECT_EQ(groups[0].columns, std::vector<Eigen::Index>{1});
  EXPECT_EQ(groups[1].columns, std::vector<Eigen::Index>{2});
}

TEST(FrictionGroups, DirectionsVaryByThemselvesWhereTheModelHasTheirAsymmetry) {
  const auto term = [](const char* name) { return candidate_term(catalogue::get(name)); };
  const Terms terms{term("coulomb_friction"), term("coulomb_asymmetry"), term("viscous_friction")};
  const std::vector<FrictionGroup> groups = friction_groups(terms, free_linear_parameters(terms, {0, 1, 2}));
  ASSERT_EQ(groups.size(), 3u);
  EXPECT_EQ(groups[2].name, "dry friction by direction");
  // Scaled columns: torque = X theta, X the columns over `size`. A unit factor adds the friction to the asymmetry.
  const Eigen::Vector3d size(2.0, 5.0, 1.0), theta(3.0, -7.0, 4.0);
  const MatrixXd u = random_effect_directions(groups, theta, size, 3);
  EXPECT_EQ(u.col(0), Eigen::Vector3d(3.0, 0.0, 0.0));
  EXPECT_EQ(u.col(1), Eigen::Vector3d(0.0, 0.0, 4.0));
  EXPECT_EQ(u.col(2), Eigen::Vector3d(0.0, 3.0 / 2.0 * 5.0, 0.0));
}

TEST(FrictionGroups, ACatalogueHasNoMoreThanTheirMatricesHold) {
  std::set<std::string_view> surfaces;
  std::size_t asymmetries = 0;
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (!entry.info->surface.empty()) surfaces.insert(entry.info->surface);
    asymmetries += !entry.info->asymmetry_of.empty();
  }
  EXPECT_GE(surfaces.size(), 2u);
  EXPECT_GE(asymmetries, 2u);
  EXPECT_LE(static_cast<Eigen::Index>(surfaces.size() + asymmetries), kMostGroups);
}

TEST(NoiseCovarianceOfOneRecord, MakesTheDenseCovarianceTheIdentity) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  VectorXd root(12);
  MatrixXd common(5, 2);
  for (double& w : root) w = 1.0 + 0.5 * std::abs(normal(random));
  for (double& c : common.reshaped()) c = 3.0 * normal(random);
  NoiseCovariance error_covariance(root);
  error_covariance.add_random_effects({0, 4, 9}, common);
  MatrixXd inner = MatrixXd::Identity(12, 12);
  inner.block(4, 4, 5, 5) += common * common.transpose();
  const MatrixXd inverse = root.cwiseInverse().asDiagonal();
  const MatrixXd W = error_covariance.whiten(MatrixXd::Identity(12, 12));
  EXPECT_LT((W * (inverse * inner * inverse) * W.transpose() - MatrixXd::Identity(12, 12)).norm(), 1e-10);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_random_effects_test
