#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/cross_validation.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/disturbances.hpp"
#include "tests/support/plain_model.hpp"

namespace flexspline::selection::diagnosis_search_test {
namespace {

using data::Column;
using estimation::Balance;
using tests::plain_model;

constexpr double kPi = 3.14159265358979323846;
constexpr double kInertia = 1e-3, kViscous = 4e-3, kCoulomb = 0.05;
const estimation::PipelineOptions kOptions{40.0, true};

struct Recipe {
  double phase = 0.0;
  double seconds = 5.0;
  double noise = 0.002;  // standard deviation of the torque
  unsigned seed = 1;
  double late_s = 0.0;  // the torque is logged as it was that long ago
  std::function<double(double t, double q, double w)> extra = [](double, double, double) { return 0.0; };
  bool with_reversals = false;
};

// An axis whose motion (three sines that do not come round within a record) and torque are written down, not simulated.
data::Experiment experiment(const Recipe& recipe) {
  std::mt19937_64 random(recipe.seed);
  std::normal_distribution<double> noise;
  const auto motion = [&](double t) {
    std::array<double, 3> m{};
    for (const auto& [amplitude, frequency_hz] : {std::pair{3.0, 0.9123}, {0.5, 2.7183}, {0.8, 0.3717}}) {
      const double rate = 2.0 * kPi * frequency_hz, angle = rate * t + recipe.phase * frequency_hz;
      m[0] += amplitude * std::sin(angle);
      m[1] += amplitude * rate * std::cos(angle);
      m[2] -= amplitude * rate * rate * std::sin(angle);
    }
    return m;
  };
  data::Experiment e;
  e.name = "phase " + std::to_string(recipe.phase);
  e.sample_s = 1e-3;
  e.current_hold = data::CurrentHold::none;
  const auto n = static_cast<std::size_t>(std::lround(recipe.seconds * 1000.0));
  for (std::size_t k = 0; k < n; ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    const auto [q, w, a] = motion(t - recipe.late_s);
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(motion(t)[0]);
    e[Column::motor_torque].push_back(kInertia * a + kViscous * w + std::copysign(kCoulomb, w) + recipe.extra(t, q, w) +
                                      recipe.noise * noise(random));
  }
  e.segments = {{0, n}};
  return e;
}

estimation::PipelineOptions options(const Recipe& recipe) {
  estimation::PipelineOptions options = kOptions;
  options.keep_motor_reversals = recipe.with_reversals;
  return options;
}

// One record with what a search keeps of it.
struct Bench {
  data::Experiment record;
  estimation::PreparedData prepared;
  RegressionProblem data;
  Eigen::VectorXd keep;
  Terms terms = estimation::terms_of(plain_model());
  CrossValidatedFit base;

  explicit Bench(const Recipe& recipe)
      : record(experiment(recipe)),
        prepared(estimation::prepare({&record}, {}, options(recipe))),
        data(prepared, Balance::motor),
        keep(Eigen::VectorXd::Ones(data.rows())),
        base(cross_validate(data, terms, keep)) {}

  LikelihoodGain with(std::string_view effect, std::optional<double> order, double added) {
    return likelihood_gain(base, cross_validate(data, extend(terms, catalogue::get(effect), order), keep), added);
  }
  double effective_rows() const { return static_cast<double>(data.rows()) / base.autocorrelation_time; }
};

// A cross-validated fit of records with these squares of left-out rows.
CrossValidatedFit cross_validated(std::vector<double> squares, std::vector<double> rows, double tau) {
  CrossValidatedFit j;
  for (std::size_t i = 0; i < rows.size(); ++i) j.left_out.push_back({rows[i], squares[i]});
  j.autocorrelation_time = tau;
  return j;
}

TEST(LikelihoodGainOf, IsTheLogLikelihoodOverTheAutocorrelationTimeLessThePenalty) {
  const LikelihoodGain gain =
      likelihood_gain(cross_validated({200.0}, {100.0}, 4.0), cross_validated({100.0}, {100.0}, 2.0), 2.0);
  // The extended model's autocorrelation time; the base's would count what is missing as colour.
  const double ratio = 100.0 * std::log(2.0) / 2.0;
  EXPECT_NEAR(gain.score, ratio - 2.0 * std::log(50.0), 1e-9);
  EXPECT_NEAR(gain.chi2_percent, 50.0, 1e-9);
  EXPECT_NEAR(gain.p_value, std::exp(-0.5 * ratio), 1e-20) << "chi-square of two degrees of freedom";
  EXPECT_NEAR(
      likelihood_gain(cross_validated({200.0}, {100.0}, 2.0), cross_validated({100.0}, {100.0}, 9.0), 2.0).score,
      gain.score, 1e-9)
      << "capped by the base's";
}

TEST(LikelihoodGainOf, OneParameterHasTheTailOfOneDegreeOfFreedom) {
  const LikelihoodGain gain =
      likelihood_gain(cross_validated({110.0}, {100.0}, 1.0), cross_validated({100.0}, {100.0}, 1.0), 1.0);
  EXPECT_NEAR(gain.p_value, std::erfc(std::sqrt(0.5 * 100.0 * std::log(1.1))), 1e-12);
}

TEST(LikelihoodGainOf, ARecordThatGotWorseCountsAgainst) {
  const CrossValidatedFit base = cross_validated({100.0, 100.0}, {100.0, 100.0}, 1.0);
  const LikelihoodGain mixed = likelihood_gain(base, cross_validated({50.0, 200.0}, {100.0, 100.0}, 1.0), 0.0);
  EXPECT_NEAR(mixed.score, 0.0, 1e-9) << "half the noise here, twice the noise there";
  const LikelihoodGain worse = likelihood_gain(base, cross_validated({100.0, 120.0}, {100.0, 100.0}, 1.0), 0.0);
  EXPECT_NEAR(worse.score, -100.0 * std::log(1.2), 1e-9);
  EXPECT_LT(worse.chi2_percent, 0.0);
  EXPECT_EQ(worse.p_value, 1.0);
}

TEST(LikelihoodGainOf, ANearlySilentRecordDoesNotRule) {
  // Its noise falls by a factor 1e6, from a hundredth of the median's variance at most.
  const CrossValidatedFit base = cross_validated({100.0, 100.0, 1e-3}, {100.0, 100.0, 100.0}, 1.0);
  EXPECT_NEAR(likelihood_gain(base, cross_validated({100.0, 100.0, 1e-9}, {100.0, 100.0, 100.0}, 1.0), 0.0).score, 0.0,
              1e-9);
}

TEST(LikelihoodGainOf, AUselessColumnGainsNothingOnAverage) {
  double percent = 0.0, ratio = 0.0, highest = -1e9;
  constexpr int kSeeds = 30;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    Bench bench({.seed = seed});
    const LikelihoodGain gain = bench.with("torque_ripple", 7.0, 2.0);
    percent += gain.chi2_percent / kSeeds;
    // Without the penalty: each needless parameter costs left-out rows somewhat more than one.
    ratio += (gain.score + 2.0 * std::log(bench.effective_rows())) / kSeeds;
    highest = std::max(highest, gain.score);
  }
  EXPECT_NEAR(ratio, -2.5, 2.5);
  EXPECT_NEAR(percent, -1.0, 1.0);
  EXPECT_LT(highest, 0.0);
}

TEST(LikelihoodGainOf, ATrueColumnGainsInProportionToTheLengthOfTheRecord) {
  const auto gain = [](double seconds) {
    double sum = 0.0;
    for (unsigned seed = 1; seed <= 8; ++seed) {
      Bench bench({.seconds = seconds, .seed = seed, .extra = [](double, double q, double) {
                     return 4e-4 * std::cos(7.0 * q);
                   }});
      sum += bench.with("torque_ripple", 7.0, 2.0).score + 2.0 * std::log(bench.effective_rows());
    }
    return sum / 8.0;
  };
  const double once = gain(8.0), twice = gain(16.0);
  EXPECT_GT(once, 20.0);
  EXPECT_NEAR(twice / once, 2.0, 0.4);
}

TEST(CrossValidate, PredictsEachFifthAsAFitOfTheOthersDoes) {
  const Bench bench({.extra = [](double, double q, double) { return 1e-3 * std::cos(3.0 * q); }});
  const RegressionProblem& data = bench.data;
  Eigen::MatrixXd X(data.rows(), 4);
  X << data.columns(bench.terms, bench.base.linear), data.delay_column();
  using Exact = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  double squares = 0.0;
  for (const auto& fold : data.folds(5)) {
    Exact A = X.cast<long double>();
    Exact b = data.target().cast<long double>();
    A.middleRows(fold[0].first, fold[0].size()).setZero();
    b.middleRows(fold[0].first, fold[0].size()).setZero();
    const Exact theta = Exact(A.transpose() * A).partialPivLu().solve(A.transpose() * b);
    squares += (data.target().segment(fold[0].first, fold[0].size()) -
                X.middleRows(fold[0].first, fold[0].size()) * theta.cast<double>())
                   .squaredNorm();
  }
  ASSERT_EQ(bench.base.left_out.size(), 1u);
  EXPECT_NEAR(bench.base.left_out[0].squares / squares, 1.0, 1e-6);
  EXPECT_EQ(bench.base.left_out[0].rows, static_cast<double>(data.rows()));
  EXPECT_GT(bench.base.rmse_cv(), bench.base.rmse());
}

TEST(CrossValidate, ADelayOfTheEffortIsANuisanceThatBiasesNothing) {
  for (const double late_s : {0.4e-3, -0.4e-3}) {
    const Bench bench({.noise = 1e-4, .late_s = late_s});
    EXPECT_NEAR(bench.base.theta[3], late_s, 0.2e-4);
    EXPECT_NEAR(bench.base.theta[0] / kInertia, 1.0, 0.01);
    EXPECT_NEAR(bench.base.theta[1] / kViscous, 1.0, 0.01);
    EXPECT_NEAR(bench.base.theta[2] / kCoulomb, 1.0, 0.01);
  }
}

TEST(CrossValidate, RowsThatDoNotCountMoveNothing) {
  Bench bench({});
  const Bench pushed({.extra = [](double t, double, double) { return t > 2.0 && t < 2.5 ? 1.0 : 0.0; }});
  const RegressionProblem& data = pushed.data;
  Eigen::VectorXd keep = pushed.keep;
  for (Eigen::Index row = 0; row < data.rows(); ++row) {
    const double t = 1e-3 * static_cast<double>(data.sample_of(data.records()[0], row));
    if (t > 1.8 && t < 2.7) keep[row] = 0.0;
  }
  const CrossValidatedFit with = cross_validate(data, bench.terms, keep),
                          without = cross_validate(bench.data, bench.terms, keep);
  for (Eigen::Index j = 0; j < 3; ++j) EXPECT_NEAR(with.theta[j] / without.theta[j], 1.0, 1e-3) << j;
  EXPECT_NEAR(with.rmse_cv() / without.rmse_cv(), 1.0, 1e-2);
  EXPECT_EQ(with.left_out[0].rows, (keep.array() > 0.0).count());
}

std::vector<Disturbance> disturbances_of(Bench& bench) {
  return find_disturbances(bench.data, bench.base.residual, bench.keep);
}

// Between reversals (at 2.92 s and 3.47 s): near one it could be friction.
TEST(Disturbances, APushIsFoundAtItsTimeAndLeftOut) {
  constexpr double kFrom = 3.16, kLength = 0.06, kPeak = 0.05;
  Bench bench({.extra = [&](double t, double, double) {
    return t > kFrom && t < kFrom + kLength ? kPeak * std::sin(kPi * (t - kFrom) / kLength) : 0.0;
  }});
  const auto found = disturbances_of(bench);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].experiment, bench.record.name);
  EXPECT_NEAR(found[0].from_s, kFrom, 0.02);
  EXPECT_NEAR(found[0].to_s, kFrom + kLength, 0.02);
  EXPECT_NEAR(found[0].peak / kPeak, 1.0, 0.25);
  for (Eigen::Index row = 0; row < bench.data.rows(); ++row) {
    const double t = 1e-3 * static_cast<double>(bench.data.sample_of(bench.data.records()[0], row));
    if (t > kFrom && t < kFrom + kLength) {
      EXPECT_EQ(bench.keep[row], 0.0) << t;
    } else if (t < kFrom - 0.15 || t > kFrom + kLength + 0.15) {
      EXPECT_EQ(bench.keep[row], 1.0) << t;
    }
  }
}

// A model with a law of presliding is judged with the samples around reversals, where it fits worst.
TEST(Disturbances, WhatPreslidingLeavesAroundReversalsIsNone) {
  double since = 0.0, before = 0.0;
  Bench bench({.extra =
                   [&](double, double q, double w) {
                     if (w * before < 0.0) since = q;
                     before = w;
                     return -0.08 * std::copysign(std::exp(-std::abs(q - since) / 0.01), w);
                   },
               .with_reversals = true});
  EXPECT_TRUE(disturbances_of(bench).empty());
}

TEST(Disturbances, NoiseIsNone) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Bench bench({.seed = seed});
    EXPECT_TRUE(disturbances_of(bench).empty()) << seed;
    EXPECT_EQ(bench.keep.minCoeff(), 1.0);
  }
}

TEST(Disturbances, RippleIsNone) {
  Bench bench({.extra = [](double, double q, double) { return 0.02 * std::cos(7.0 * q); }});
  EXPECT_TRUE(disturbances_of(bench).empty());
}

TEST(Disturbances, ABumpThatStandsAtAnAngleIsNone) {
  // Passed at many speeds in both directions: as high as the push above, but it comes with the angle.
  Bench bench({.seconds = 8.0,
               .extra = [](double, double q, double) { return 0.05 * std::exp(-std::pow((q - 0.7) / 0.3, 2)); }});
  EXPECT_TRUE(disturbances_of(bench).empty());
}

data::Dataset two_records(const std::function<double(double, double, double)>& extra, unsigned seed,
                          double late_s = 0.0) {
  data::Dataset dataset;
  for (const double phase : {0.0, 2.0})
    dataset.experiments.push_back(
        experiment({.phase = phase, .seed = seed + (phase > 0.0 ? 100 : 0), .late_s = late_s, .extra = extra}));
  return dataset;
}

Diagnosis diagnosed(const data::Dataset& dataset) {
  Options options;
  options.pipeline = kOptions;
  return diagnose(dataset, plain_model(), options);
}

TEST(Diagnose, NamesViscousAsymmetry) {
  const Diagnosis d = diagnosed(two_records([](double, double, double w) { return 2e-4 * std::abs(w); }, 1));
  EXPECT_EQ(d.verdict, Verdict::missing_effect);
  ASSERT_EQ(d.named.size(), 1u);
  EXPECT_EQ(d.named[0].effect, "viscous_asymmetry");
  ASSERT_FALSE(d.candidates.empty());
  const Candidate& first = d.candidates.front();
  EXPECT_EQ(first.effect, "viscous_asymmetry");
  EXPECT_GT(first.score, 20.0);
  EXPECT_LT(first.rmse_cv_after, first.rmse_cv_before);
  ASSERT_EQ(first.parameters.size(), 1u);
  EXPECT_NEAR(first.parameters[0].value, 2e-4, 2e-5);
  EXPECT_LT(*first.parameters[0].low, 2e-4);
  EXPECT_GT(*first.parameters[0].high, 2e-4);
  EXPECT_EQ(d.balance, Balance::motor);
  EXPECT_TRUE(d.disturbances.empty());
}

TEST(Diagnose, NamesNothingWhereNothingIsMissing) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const Diagnosis d = diagnosed(two_records([](double, double, double) { return 0.0; }, seed));
    EXPECT_TRUE(d.named.empty()) << seed;
    EXPECT_NE(d.verdict, Verdict::missing_effect);
    EXPECT_NE(d.verdict, Verdict::confusable_effects);
    EXPECT_FALSE(d.delay_s) << seed;
    for (const Candidate& c : d.candidates) EXPECT_TRUE(!c.admissible || c.score < 20.0) << c.effect << ' ' << c.score;
  }
}

TEST(Diagnose, ADelayIsReportedAndNotTakenForAnEffect) {
  const Diagnosis d = diagnosed(two_records([](double, double, double) { return 0.0; }, 3, 1e-3));
  EXPECT_TRUE(d.named.empty());
  ASSERT_TRUE(d.delay_s);
  EXPECT_NEAR(*d.delay_s, 1e-3, 2e-4);
}

TEST(Diagnose, APushIsListedWithItsUnitAndNamesNothing) {
  const Diagnosis d = diagnosed(
      two_records([](double t, double,
                     double) { return std::abs(t - 2.75) < 0.03 ? 0.05 * std::cos(kPi * (t - 2.75) / 0.06) : 0.0; },
                  4));
  EXPECT_TRUE(d.named.empty());
  ASSERT_FALSE(d.disturbances.empty());
  EXPECT_EQ(d.disturbances[0].unit, "N*m");
}

}  // namespace
}  // namespace flexspline::selection::diagnosis_search_test
