// The statistical parts of the selection of effects, each alone: against closed forms, and against what statsmodels and
// SciPy make of tests/unit/fixtures/statistics.json.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "host/engine/estimation/variance_components.hpp"
#include "host/engine/selection/bandwidth.hpp"
#include "host/engine/selection/forward_selection.hpp"
#include "host/engine/selection/frequent_groups.hpp"
#include "host/engine/selection/friction_random_effects.hpp"
#include "host/engine/selection/halves.hpp"

namespace flexspline::selection::selection_test {
namespace {

nlohmann::json statistics() {
  std::ifstream file(std::filesystem::path(FLEXSPLINE_SOURCE_DIR) / "tests/unit/fixtures/statistics.json");
  return nlohmann::json::parse(file);
}

// Products of each record, with some columns of x as random effects.
std::vector<estimation::RecordProducts> products_of(const nlohmann::json& problem,
                                                    const std::vector<Eigen::Index>& random) {
  std::map<int, std::pair<std::vector<Eigen::RowVector3d>, std::vector<double>>> records;
  for (std::size_t k = 0; k < problem["y"].size(); ++k) {
    auto& [x, y] = records[problem["record"][k].get<int>()];
    x.emplace_back(problem["x"][k][0].get<double>(), problem["x"][k][1].get<double>(),
                   problem["x"][k][2].get<double>());
    y.push_back(problem["y"][k].get<double>());
  }
  std::vector<estimation::RecordProducts> result;
  for (const auto& [record, rows] : records) {
    Eigen::MatrixXd x(static_cast<Eigen::Index>(rows.first.size()), 3);
    for (std::size_t k = 0; k < rows.first.size(); ++k) x.row(static_cast<Eigen::Index>(k)) = rows.first[k];
    const Eigen::Map<const Eigen::VectorXd> y(rows.second.data(), x.rows());
    const Eigen::MatrixXd z = x(Eigen::all, random);
    result.push_back({x.transpose() * x, x.transpose() * z, z.transpose() * z, x.transpose() * y, z.transpose() * y});
  }
  return result;
}

TEST(VarianceComponents, OneComponentIsThatOfStatsmodels) {
  const nlohmann::json fixture = statistics();
  const auto& truth = fixture["reml_sign_by_record"];
  const auto found = estimation::reml(products_of(fixture["problem"], {2}), truth["sigma2"].get<double>(), 1e-4, 10.0);
  EXPECT_NEAR(found.variance[0], truth["variance_of_sign"].get<double>(),
              0.01 * truth["variance_of_sign"].get<double>());
  for (Eigen::Index j = 0; j < 3; ++j)
    EXPECT_NEAR(found.beta[j], truth["params"][static_cast<std::size_t>(j)].get<double>(), 1e-4);
}

TEST(VarianceComponents, TwoComponentsAreThoseOfAGeneralOptimiser) {
  const nlohmann::json fixture = statistics();
  const auto& truth = fixture["reml_sign_and_velocity_by_record"];
  const auto found =
      estimation::reml(products_of(fixture["problem"], {2, 1}), truth["sigma2"].get<double>(), 1e-4, 10.0);
  for (std::size_t g = 0; g < 2; ++g) {
    const double variance = truth["variances"][g].get<double>();
    EXPECT_NEAR(found.variance[static_cast<Eigen::Index>(g)], variance, 0.02 * variance);
  }
}

TEST(VarianceComponents, FewerThanThreeRecordsShowNone) {
  auto records = products_of(statistics()["problem"], {2});
  records.resize(2);
  EXPECT_EQ(estimation::reml(records, 0.01, 1e-4, 10.0).variance[0], 0.0);
}

// Of two records whose friction is alike, REML makes nothing; the posterior mode stays near that of the prior.
TEST(VarianceComponents, APriorKeepsWhatFewRecordsCannotShow) {
  Eigen::MatrixXd one(50, 1);
  one.setOnes();
  std::vector<estimation::RecordProducts> records;
  for (int r = 0; r < 2; ++r) {
    const Eigen::VectorXd y = Eigen::VectorXd::Constant(50, 1.0);
    records.push_back({one.transpose() * one, one.transpose() * one, one.transpose() * one, one.transpose() * y,
                       one.transpose() * y});
  }
  EXPECT_EQ(estimation::reml(records, 1e-4, 1e-4, 10.0).variance[0], 0.0);
  const double std = std::sqrt(estimation::reml(records, 1e-4, 1e-4, 10.0, {0.03, 2.0}).variance[0]);
  EXPECT_GT(std, 0.01);
  EXPECT_LT(std, 0.03);
}

TEST(VarianceComponents, ManyRecordsOutweighThePrior) {
  const nlohmann::json fixture = statistics();
  const auto& truth = fixture["reml_sign_by_record"];
  const auto records = products_of(fixture["problem"], {2});
  const double noise = truth["sigma2"].get<double>(), alone = truth["variance_of_sign"].get<double>();
  const double with = estimation::reml(records, noise, 1e-4, 10.0, {0.03, 2.0}).variance[0];
  const double n = static_cast<double>(records.size());
  // The mean of the records' variance and of the prior's mode, weighted by records and by what the prior is worth.
  EXPECT_GT(with, 0.8 * n / (n + 2.0) * alone);
  EXPECT_LT(with, alone);
}

TEST(Bandwidth, FourthDifferencesGiveTheNoiseOfASmoothMotion) {
  std::mt19937_64 chance(7);
  std::normal_distribution<double> noise(0.0, 1e-4);
  std::vector<double> position(20000);
  for (std::size_t k = 0; k < position.size(); ++k)
    position[k] = std::sin(2.0 * std::numbers::pi * static_cast<double>(k) / 1000.0) + noise(chance);
  EXPECT_NEAR(noise_by_fourth_differences(position, {{0, position.size()}}), 1e-4, 3e-6);
}

// A table of random columns: two of the model, and single terms.
struct Random {
  RegressorTable table;
  Eigen::MatrixXd rows;
};
Random random_table(Eigen::Index count, Eigen::Index terms, unsigned seed) {
  std::mt19937_64 chance(seed);
  std::normal_distribution<double> normal;
  Random r;
  r.rows = Eigen::MatrixXd::NullaryExpr(count, terms + 3, [&] { return normal(chance); });
  r.table.model_columns = 2;
  r.table.scale = Eigen::VectorXd::Ones(terms + 3);
  r.table.model_low = {-effects::kUnbounded, -effects::kUnbounded};
  for (Eigen::Index t = 0; t < terms; ++t) {
    CandidateTerm term;
    term.name = "term " + std::to_string(t);
    term.entry = &catalogue::all().front();
    term.columns = {2 + t};
    term.low = {-effects::kUnbounded};
    r.table.terms.push_back(term);
  }
  return r;
}
HalfData half_of(const Eigen::MatrixXd& rows) {
  return {rows.transpose() * rows, {}, static_cast<double>(rows.rows())};
}

// Generalised least squares with the covariance written out is the independent truth.
TEST(RecordDifferences, EliminationIsGeneralisedLeastSquares) {
  Random r = random_table(60, 1, 11);
  const double noise = 0.5, variance = 0.3;
  const FrictionRandomEffects differences{{1}, Eigen::VectorXd::Constant(1, variance), noise};
  Eigen::MatrixXd products = r.rows.transpose() * r.rows;
  eliminate_friction_effects(products, differences);
  const Eigen::MatrixXd V =
      noise * Eigen::MatrixXd::Identity(60, 60) + variance * r.rows.col(1) * r.rows.col(1).transpose();
  const Eigen::MatrixXd truth = noise * (r.rows.transpose() * V.inverse() * r.rows);
  EXPECT_LT((products - truth).norm(), 1e-9 * truth.norm());
}

// The residual less the prediction of the record's own coefficient is noise * V^-1 times the residual (Henderson 1975).
TEST(RecordDifferences, ResidualIsWhatTheBestLinearUnbiasedPredictionLeaves) {
  Random r = random_table(60, 1, 12);
  const double noise = 0.5, variance = 0.3, weight = 4.0;
  const FrictionRandomEffects differences{{1}, Eigen::VectorXd::Constant(1, variance), noise};
  Setting setting;
  setting.rows = r.rows;
  setting.sign_width = r.rows.cols();
  setting.runs = {{0, 0, 30, 0.01}, {0, 30, 60, 0.01}};
  TermFit fitted;
  fitted.columns = {0};
  fitted.theta = Eigen::VectorXd::Constant(1, 2.0);
  const Eigen::VectorXd raw = r.rows.col(3) - 2.0 * r.rows.col(0);
  const Eigen::MatrixXd V =
      noise / weight * Eigen::MatrixXd::Identity(60, 60) + variance * r.rows.col(1) * r.rows.col(1).transpose();
  const Eigen::VectorXd truth = std::sqrt(weight) * (noise / weight) * V.llt().solve(raw);
  EXPECT_LT((weighted_residual(setting, Direction::sign, fitted, {weight}, differences) - truth).norm(),
            1e-9 * truth.norm());
}

// Two records of three blocks with ten samples each.
Setting blocks_of(const Eigen::MatrixXd& rows) {
  Setting setting;
  setting.rows = rows;
  setting.sign_width = rows.cols();
  const Eigen::Index p = rows.cols();
  setting.products.resize(p * (p + 1) / 2, 6);
  for (Eigen::Index b = 0; b < 6; ++b) {
    setting.blocks.push_back({static_cast<std::size_t>(b / 3), 10.0});
    const Eigen::MatrixXd own = rows.middleRows(10 * b, 10);
    setting.products.col(b) = lower_triangle(own.transpose() * own);
  }
  return setting;
}

TEST(Setting, LowerTriangleHoldsEachProductOnceAtItsPlace) {
  const Eigen::MatrixXd rows = random_table(9, 2, 3).rows;
  const Eigen::MatrixXd square = rows.transpose() * rows;
  const Eigen::VectorXd packed = lower_triangle(square);
  ASSERT_EQ(packed.size(), 15);
  for (Eigen::Index i = 0; i < 5; ++i)
    for (Eigen::Index j = 0; j < 5; ++j)
      EXPECT_EQ(packed[place_in_triangle(i, j, 5)], square(std::max(i, j), std::min(i, j)));
}

TEST(Halves, HoldTheProductsOfTheirSamplesWithTheDifferencesOfEachRecordEliminated) {
  const Random r = random_table(60, 2, 21);
  const Setting setting = blocks_of(r.rows);
  const std::vector<double> weights = {2.0, 0.5};
  const std::vector<std::vector<std::uint8_t>> in = {{1, 0, 0, 1, 1, 0}, {1, 1, 1, 0, 0, 0}};
  const FrictionRandomEffects differences{{1}, Eigen::VectorXd::Constant(1, 0.3), 0.5};
  const std::vector<HalfPair> pairs = halves_of(setting, weights, in, differences);
  ASSERT_EQ(pairs.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i)
    for (const std::size_t half : {std::size_t{0}, std::size_t{1}}) {
      Eigen::MatrixXd truth = Eigen::MatrixXd::Zero(5, 5);
      double rows = 0.0;
      for (std::size_t record = 0; record < 2; ++record) {
        Eigen::MatrixXd own = Eigen::MatrixXd::Zero(5, 5);
        for (std::size_t b = 3 * record; b < 3 * record + 3; ++b) {
          if ((in[i][b] == 1) != (half == 0)) continue;
          const Eigen::MatrixXd samples = r.rows.middleRows(10 * static_cast<Eigen::Index>(b), 10);
          own += weights[record] * samples.transpose() * samples;
          rows += 10.0;
        }
        eliminate_friction_effects(own, differences);
        truth += own;
      }
      EXPECT_LT((pairs[i][half].sign - truth).norm(), 1e-12 * truth.norm());
      EXPECT_EQ(pairs[i][half].rows, rows);
    }
}

TEST(RegressorTable, WithFewerTermsKeepsTheColumnsOfTheModelAndOfThese) {
  Random r = random_table(30, 4, 22);
  r.table.columns = r.rows.leftCols(6);
  r.table.scale = r.table.columns.colwise().norm();
  r.table.differences = {5};
  r.table.terms.pop_back();
  const ChosenColumns chosen = choose_columns(r.table, {2, 0});
  const RegressorTable& small = chosen.table;
  EXPECT_EQ(chosen.columns, (std::vector<Eigen::Index>{0, 1, 4, 2, 5}));
  EXPECT_EQ(small.columns.cols(), 5);
  EXPECT_EQ(small.scale, r.table.scale(std::vector<Eigen::Index>{0, 1, 4, 2, 5}));
  ASSERT_EQ(small.terms.size(), 2U);
  EXPECT_EQ(small.terms[0].name, "term 2");
  EXPECT_EQ(small.terms[0].columns.front(), 2);
  EXPECT_EQ(small.differences.front(), 4);
}

// What an error of a wave's phase leaves is not chosen behind it, nor the reverse.
TEST(ForwardSelection, DoesNotChooseWhatAnErrorOfThePhaseOfAChosenWaveLeaves) {
  Random r = random_table(400, 3, 5);
  r.rows.col(5) = 2.0 * r.rows.col(2) + 1.5 * r.rows.col(3) + 0.1 * r.rows.col(5);
  const HalfData all = half_of(r.rows);
  const auto chosen = [&] {
    std::vector<int> terms;
    for (const SelectionStep& s : select_forward(r.table, all, all, {0.01, 1.0}, {}).steps) terms.push_back(s.term);
    return terms;
  };
  EXPECT_EQ(chosen(), (std::vector<int>{0, 1}));
  r.table.terms[1].excludes = {r.table.terms[0].name};
  EXPECT_EQ(chosen(), (std::vector<int>{0}));
}

TEST(ForwardSelection, FitsAreThoseOfLeastSquares) {
  Random r = random_table(200, 3, 1);
  const HalfData all = half_of(r.rows);
  const TermFit fitted = fit_terms(r.table, {1}, all, all);
  const Eigen::MatrixXd X = r.rows(Eigen::all, std::vector<Eigen::Index>{0, 1, 3});
  const Eigen::VectorXd y = r.rows.col(5), theta = X.colPivHouseholderQr().solve(y);
  EXPECT_LT((fitted.theta - theta).norm(), 1e-6);
  EXPECT_NEAR(fitted.training_squares, (y - X * theta).squaredNorm(), 1e-6);
}

TEST(ForwardSelection, ChoosesWhatIsThereAndNothingElse) {
  Random r = random_table(400, 20, 2);
  r.rows.col(22) = 0.1 * r.rows.col(22) + r.rows.col(0) - 0.4 * r.rows.col(9);
  const HalfData a = half_of(r.rows.topRows(200)), b = half_of(r.rows.bottomRows(200));
  const SelectionPath selected = select_forward(r.table, a, b, {0.01, 1.0}, {});
  ASSERT_EQ(selected.steps.size(), 1U);
  EXPECT_EQ(selected.steps[0].term, 7);
  EXPECT_NEAR(selected.steps[0].of_all, 1.0, 0.05);
}

TEST(ForwardSelection, AbstainsWhereNothingStandsAboveTheNoise) {
  Random r = random_table(400, 20, 3);
  r.rows.col(22) = r.rows.col(22) + r.rows.col(0);
  const HalfData a = half_of(r.rows.topRows(200)), b = half_of(r.rows.bottomRows(200));
  EXPECT_TRUE(select_forward(r.table, a, b, {1.1, 1.0}, {}).abstains);
}

TEST(ForwardSelection, AbstainsWhereTheModelAloneDoesNotCarryOver) {
  Random r = random_table(400, 2, 4);
  r.rows.col(4) = 0.01 * r.rows.col(4) + r.rows.col(0);
  r.rows.topRows(200).col(1).setZero();
  r.rows.bottomRows(200).col(4) += 3.0 * r.rows.bottomRows(200).col(1);
  const HalfData a = half_of(r.rows.topRows(200)), b = half_of(r.rows.bottomRows(200));
  EXPECT_TRUE(select_forward(r.table, a, b, {1e-4, 1.0}, {}).abstains);
}

TEST(ForwardSelection, ChoosesATermWithoutWhichTheModelDoesNotCarryOver) {
  Random r = random_table(400, 2, 4);
  r.rows.topRows(200).col(2) *= 0.1;
  r.rows.col(4) = 0.01 * r.rows.col(4) + r.rows.col(0) + r.rows.col(2);
  const HalfData a = half_of(r.rows.topRows(200)), b = half_of(r.rows.bottomRows(200));
  const SelectionPath selected = select_forward(r.table, a, b, {1e-4, 1.0}, {});
  EXPECT_FALSE(selected.abstains);
  ASSERT_EQ(selected.steps.size(), 1U);
  EXPECT_EQ(selected.steps[0].term, 0);
}

TEST(ForwardSelection, ATermOfImpossibleSignIsNotChosen) {
  Random r = random_table(400, 20, 5);
  r.table.terms[7].low = {0.0};
  r.rows.col(22) = 0.1 * r.rows.col(22) - 0.4 * r.rows.col(9);
  const HalfData a = half_of(r.rows.topRows(200)), b = half_of(r.rows.bottomRows(200));
  EXPECT_TRUE(select_forward(r.table, a, b, {0.01, 1.0}, {}).steps.empty());
}

Frequency frequency(std::string name, double often, double near, double share) {
  Frequency f;
  f.name = std::move(name);
  f.entry = &catalogue::all().front();
  f.frequency = often;
  f.near = near;
  f.share = share;
  return f;
}

TEST(Decision, NamesWhatIsChosenOftenEnoughAlone) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("often", 0.8, 0.8, 0.5), frequency("seldom", 0.4, 0.45, 0.5)};
  const auto found = frequent_groups(s, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].group.size(), 1U);
  EXPECT_EQ(found[0].group[0].name, "often");
}

TEST(Decision, WhatNeitherEnoughSubsamplesChoseNorEnoughDidNotIsUndecided) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("often", 0.8, 0.8, 0.5), frequency("half", 0.5, 0.5, 0.5),
                   frequency("curve", 0.5, 0.5, 0.5), frequency("seldom", 0.35, 0.39, 0.5)};
  s.frequencies[2].entry = nullptr;
  const auto open = undecided(s, frequent_groups(s, {}), {});
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0].group[0].name, "half");
  s.abstained = 80.0;
  EXPECT_TRUE(undecided(s, {}, {}).empty());
}

TEST(Decision, WhatIsChosenOftenButNotOftenEnoughBehindAnUnknownStructureIsUndecided) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("curve", 0.8, 0.8, 0.2), frequency("law", 0.8, 0.8, 0.7)};
  s.frequencies[0].entry = nullptr;
  s.frequencies[0].first = 1.0;
  const auto found = frequent_groups(s, {});
  ASSERT_EQ(found.size(), 1U);
  const auto open = undecided(s, found, {});
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0].group[0].name, "law");
}

TEST(Decision, WhatIsNotChosenWithReversalsOrNotWithoutThemIsUndecided) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("law", 0.7, 0.7, 0.5)};
  s.frequencies[0].least_near_by_mask = 0.41;
  EXPECT_EQ(frequent_groups(s, {}).size(), 1U);
  s.frequencies[0].least_near_by_mask = 0.39;
  EXPECT_TRUE(frequent_groups(s, {}).empty());
  const auto open = undecided(s, {}, {});
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0].least_by_mask, 0.39);
}

TEST(Decision, GroupsWhatTakesTurns) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("one", 0.5, 0.9, 0.5), frequency("other", 0.4, 0.9, 0.5)};
  s.frequencies[0].alternatives = {{"other", 0.8}};
  const auto found = frequent_groups(s, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].group.size(), 2U);
  EXPECT_NEAR(found[0].frequency, 0.9, 1e-12);
}

// A law, with how often it came first, and a structure that is in no catalogue.
std::vector<FoundTerm> with_unknown_structure(double law_first, double law_frequency) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("curve", 0.8, 0.8, 0.2), frequency("law", law_frequency, law_frequency, 0.7)};
  s.frequencies[0].entry = nullptr;
  s.frequencies[0].first = 1.0 - law_first;
  s.frequencies[1].first = law_first;
  return frequent_groups(s, {});
}

TEST(Decision, ALawThatComesBeforeAnUnknownStructureNeedsTheOrdinaryFrequency) {
  EXPECT_EQ(with_unknown_structure(0.7, 0.8).size(), 2U);
}

TEST(Decision, ALawThatComesAfterAnUnknownStructureNeedsTheHigherFrequency) {
  const auto found = with_unknown_structure(0.2, 0.8);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].group[0].name, "curve");
  EXPECT_EQ(with_unknown_structure(0.2, 0.95).size(), 2U);
}

TEST(Decision, ATermThatMayTakeTheFirstOnesPlaceIsInItsGroupThoughItIsAlsoChosenBehindIt) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("gravity", 0.7, 1.0, 0.03), frequency("offset", 0.4, 1.0, 0.9)};
  s.frequencies[0].first = 0.1;
  s.frequencies[1].first = 0.4;
  s.frequencies[1].alternatives = {{"gravity", 0.9}};
  const auto found = frequent_groups(s, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].group.size(), 2U);
}

// A wave, or a placebo wave where `is_placebo`.
Frequency wave(std::string name, double order, double often, double share, bool is_placebo = false) {
  Frequency f = frequency(std::move(name), often, 0.9, share);
  f.order = order;
  if (is_placebo) f.entry = nullptr;
  return f;
}

TEST(Decision, APlaceboThatDoesAsWellAsAWaveMakesItUnknown) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {wave("order 6", 6.0, 0.65, 0.5), wave("placebo order 5.31", 5.31, 0.3, 0.5, true)};
  s.frequencies[0].alternatives = {{"placebo order 5.31", 0.8}};
  const auto found = frequent_groups(s, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FALSE(found[0].in_catalogue);
}

TEST(Decision, APlaceboWaveSaysNothingAgainstALawThatIsNoWave) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("gravity", 0.9, 0.95, 0.5), wave("order 2", 2.0, 0.05, 0.5),
                   wave("placebo order 2.73", 2.73, 0.05, 0.5, true)};
  s.frequencies[0].alternatives = {{"order 2", 0.8}, {"placebo order 2.73", 0.8}};
  const auto found = frequent_groups(s, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].in_catalogue);
  EXPECT_EQ(found[0].group.size(), 1U);
  EXPECT_NEAR(found[0].frequency, 0.95, 1e-12);  // those that chose a wave chose it for what gravity has
}

TEST(Decision, WavesThatAreRefutedByALawAreNotFoundASecondTimeByThemselves) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {frequency("gravity", 0.6, 1.0, 0.6), wave("order 1", 1.0, 0.4, 0.6),
                   wave("placebo order 1.27", 1.27, 0.3, 0.6, true)};
  s.frequencies[0].first = 0.6;
  s.frequencies[1].first = 0.4;
  s.frequencies[0].alternatives = {{"order 1", 0.9}, {"placebo order 1.27", 0.9}};
  s.frequencies[1].alternatives = {{"gravity", 0.9}, {"placebo order 1.27", 0.9}};
  const auto found = frequent_groups(s, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].group.front().name, "gravity");
  EXPECT_TRUE(undecided(s, found, {}).empty());
}

TEST(Decision, AnEffectOfOneParameterThatDoesAsWellAsTheWavesIsTakenForThem) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {wave("order 1", 1.0, 0.5, 0.9), wave("placebo order 1.27", 1.27, 0.3, 0.9, true),
                   frequency("offset", 0.2, 0.9, 0.9)};
  s.frequencies[0].alternatives = {{"placebo order 1.27", 0.9}, {"offset", 0.9}};
  s.frequencies[2].near = 0.9;
  const auto found = frequent_groups(s, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].in_catalogue);
  EXPECT_EQ(found[0].group.front().name, "offset");
  s.frequencies[2].near = 0.5;
  ASSERT_EQ(frequent_groups(s, {}).size(), 1U);
  EXPECT_FALSE(frequent_groups(s, {})[0].in_catalogue) << "it does as well in half of the subsamples only";
}

TEST(Decision, AWaveIsNotSaidBesideAPlaceboWaveThatTakesOffAsMuch) {
  Stability s;
  s.subsamples = 100.0;
  s.frequencies = {wave("order 10", 10.0, 0.95, 0.07), wave("placebo order 9.71", 9.71, 0.7, 0.05, true)};
  for (const auto& found : frequent_groups(s, {})) EXPECT_FALSE(found.in_catalogue);
}

TEST(Decision, NothingIsSaidWhereMostSubsamplesAbstain) {
  Stability s;
  s.subsamples = 100.0;
  s.abstained = 80.0;
  s.frequencies = {frequency("often", 0.9, 0.9, 0.9)};
  EXPECT_TRUE(frequent_groups(s, {}).empty());
}

}  // namespace
}  // namespace flexspline::selection::selection_test
