#include "host/engine/estimation/variable_projection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/minimise.hpp"
#include "tests/support/plain_model.hpp"

namespace flexspline::estimation::estimation_variable_projection_test {
namespace {

using data::Column;
using tests::plain_model;

constexpr double kPi = 3.14159265358979323846;
constexpr double kInertia = 1e-3, kViscous = 4e-3, kCoulomb = 0.05;
const PipelineOptions kOptions{40.0, true};

using Motion = std::vector<std::array<double, 3>>;                // sines: amplitude, frequency in Hz, phase
using Law = std::function<double(double q, double w, double a)>;  // torque of the motor

double plain(double, double w, double a) {
  return kInertia * a + kViscous * w + std::copysign(kCoulomb, w);
}

// An axis whose motion and torque are written down, not simulated.
data::Experiment experiment(std::string name, const Motion& motion, const Law& law, double seconds = 5.0) {
  data::Experiment e;
  e.name = std::move(name);
  e.sample_s = 1e-3;
  e.current_hold = data::CurrentHold::none;
  for (std::size_t k = 0; k < static_cast<std::size_t>(std::lround(1000.0 * seconds)); ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    double q = 0.0, w = 0.0, a = 0.0;
    for (const auto& [amplitude, frequency_hz, phase] : motion) {
      const double rate = 2.0 * kPi * frequency_hz, angle = rate * t + phase;
      q += amplitude * std::sin(angle);
      w += amplitude * rate * std::cos(angle);
      a -= amplitude * rate * rate * std::sin(angle);
    }
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(law(q, w, a));
  }
  e.segments = {{0, e.size()}};
  return e;
}

data::Dataset dataset_of(std::vector<data::Experiment> experiments) {
  data::Dataset d;
  d.experiments = std::move(experiments);
  return d;
}

double value(const Identification& found, std::string_view effect, std::string_view parameter) {
  return *found.model.find(effect)->find(parameter)->value;
}

// Slow and fast motion, so that the bell of a Stribeck term and the rest of the curve both show.
const Motion kSlow{{1.5, 0.4, 0.3}, {0.2, 1.1, 1.0}};
const Motion kFast{{6.0, 0.7, 0.3}, {0.5, 2.7, 1.0}};

TEST(ShapeSearch, RecoversAStribeckVelocityFromExactData) {
  constexpr double kPositive = 0.03, kNegative = 0.02, kVelocity = 2.5;
  const Law law = [&](double q, double w, double a) {
    const double bell = std::exp(-(w / kVelocity) * (w / kVelocity));
    return plain(q, w, a) + (w > 0.0 ? kPositive : -kNegative) * bell;
  };
  model::Model model = plain_model();
  model.effects.push_back(catalogue::blank_effect(catalogue::get("stribeck_gaussian"), data::Axis::rotary));
  const data::Dataset dataset = dataset_of({experiment("slow", kSlow, law), experiment("fast", kFast, law)});
  const auto found = identify(dataset, model, kOptions);
  EXPECT_NEAR(value(*found, "stribeck_gaussian", "velocity") / kVelocity, 1.0, 0.01);
  EXPECT_NEAR(value(*found, "stribeck_gaussian", "amplitude_positive") / kPositive, 1.0, 0.01);
  EXPECT_NEAR(value(*found, "stribeck_gaussian", "amplitude_negative") / kNegative, 1.0, 0.01);
  EXPECT_NEAR(value(*found, "coulomb_friction", "torque") / kCoulomb, 1.0, 0.01);
  // A stated value is where the search starts, not where it ends.
  model.find("stribeck_gaussian")->find("velocity")->value = 1.2;
  EXPECT_NEAR(value(*identify(dataset, model, kOptions), "stribeck_gaussian", "velocity") / kVelocity, 1.0, 0.01);
}

TEST(ShapeSearch, RecoversTheExponentOfSublinearFrictionFromExactData) {
  constexpr double kTorque = 0.08, kExponent = 0.55, kRated = 20.0;
  const Law law = [&](double q, double w, double a) {
    return plain(q, w, a) + kTorque * std::pow(std::abs(w) / kRated, kExponent) * std::copysign(1.0, w);
  };
  model::Model model = plain_model();
  model.drive.rated_velocity_rad_s.value = kRated;
  model.effects.push_back(catalogue::blank_effect(catalogue::get("power_law_friction"), data::Axis::rotary));
  const auto found =
      identify(dataset_of({experiment("slow", kSlow, law), experiment("fast", kFast, law)}), model, kOptions);
  EXPECT_NEAR(value(*found, "power_law_friction", "exponent"), kExponent, 0.02);
  EXPECT_NEAR(value(*found, "power_law_friction", "torque") / kTorque, 1.0, 0.05);
}

TEST(ShapeSearch, RangesMapToSharesAndBack) {
  const ParameterRange linear{2.0, 10.0, false}, logarithmic{0.1, 10.0, true};
  EXPECT_DOUBLE_EQ(linear.at(0.25), 4.0);
  EXPECT_DOUBLE_EQ(linear.share(4.0), 0.25);
  EXPECT_NEAR(logarithmic.at(0.5), 1.0, 1e-12);
  EXPECT_NEAR(logarithmic.share(1.0), 0.5, 1e-12);
  EXPECT_EQ(linear.share(50.0), 1.0);
  EXPECT_EQ(logarithmic.share(0.0), 0.0);
  const std::vector<double> grid = parameter_grid(linear, 4);
  EXPECT_EQ(grid, (std::vector<double>{3.0, 5.0, 7.0, 9.0}));
}

TEST(ShapeSearch, AStribeckVelocityEndsAtAQuarterOfTheFastMotion) {
  const data::Experiment e = experiment("fast", kFast, plain);
  const PreparedData prepared = prepare({&e}, {}, kOptions);
  const RegressionProblem data(prepared, Balance::motor);
  const Term term = candidate_term(catalogue::get("stribeck_gaussian"));
  const ParameterRange range = parameter_range(data, term, 2);
  std::vector<double> speeds;
  for (const std::size_t k : prepared.records[0].rows[0].samples) speeds.push_back(prepared.records[0].inputs[k].speed);
  std::sort(speeds.begin(), speeds.end());
  EXPECT_NEAR(range.high, 0.25 * speeds[speeds.size() * 95 / 100], 0.01 * range.high);
  EXPECT_GE(range.low, speeds.front());
  EXPECT_LE(range.low, speeds[speeds.size() * 2 / 100]);
  EXPECT_TRUE(range.logarithmic);
}

TEST(BalanceRows, SlopeByAShapeIsTheDifferenceOfTorques) {
  const data::Experiment e = experiment("fast", kFast, plain);
  const PreparedData prepared = prepare({&e}, {}, kOptions);
  RegressionProblem data(prepared, Balance::motor);
  Terms terms{candidate_term(catalogue::get("stribeck_gaussian"))};
  terms[0].values = {0.03, 0.02, 2.0};
  const Eigen::VectorXd slope = data.nonlinear_columns(terms, {0}, {{0, 2}});
  constexpr double kStep = 1e-4;
  terms[0].values[2] = 2.0 + kStep;
  const Eigen::VectorXd above = data.term_torque(terms, 0);
  terms[0].values[2] = 2.0 - kStep;
  const Eigen::VectorXd difference = (above - data.term_torque(terms, 0)) / (2.0 * kStep);
  ASSERT_GT(slope.norm(), 1e-3);
  EXPECT_LT((slope - difference).norm(), 1e-6 * slope.norm());
}

TEST(BalanceRows, FoldsCutEachRecordIntoEqualPartsWithoutGapOrOverlap) {
  const data::Experiment a = experiment("a", kSlow, plain), b = experiment("b", kFast, plain, 3.0);
  const PreparedData prepared = prepare({&a, &b}, {}, kOptions);
  const RegressionProblem data(prepared, Balance::motor);
  const auto folds = data.folds(5);
  ASSERT_EQ(folds.size(), 5u);
  for (std::size_t record = 0; record < 2; ++record) {
    Eigen::Index at = data.records()[record].first;
    for (const auto& fold : folds) {
      EXPECT_EQ(fold[record].record, record);
      EXPECT_EQ(fold[record].first, at);
      EXPECT_NEAR(static_cast<double>(fold[record].size()), static_cast<double>(data.records()[record].size()) / 5.0,
                  1.0);
      at = fold[record].last;
    }
    EXPECT_EQ(at, data.records()[record].last);
  }
}

TEST(BalanceRows, ColumnsMadeTogetherAreThoseMadeOneByOne) {
  model::Model m = plain_model();
  m.effects.push_back(catalogue::blank_effect(catalogue::get("stribeck_gaussian"), data::Axis::rotary));
  // Two records that are alike share a filter, the third has its own.
  const data::Dataset d =
      dataset_of({experiment("a", kFast, plain), experiment("b", kSlow, plain), experiment("c", kFast, plain, 7.0)});
  const auto found = identify(d, m, kOptions);
  RegressionProblem together(found->prepared, Balance::motor), single(found->prepared, Balance::motor);
  const auto on_balance = terms_on(found->terms, Balance::motor, {});
  const std::vector<ParameterRef> refs = free_linear_parameters(found->terms, on_balance);
  ASSERT_EQ(refs.size(), 5U);
  const Eigen::MatrixXd columns = together.columns(found->terms, refs);
  for (std::size_t j = 0; j < refs.size(); ++j) {
    const Eigen::VectorXd alone = single.column(found->terms, refs[j]);
    EXPECT_GT(alone.norm(), 0.0);
    EXPECT_LT((columns.col(static_cast<Eigen::Index>(j)) - alone).norm(), 1e-12 * alone.norm()) << j;
  }
}

TEST(BalanceRows, ColumnsFromFewerSamplesFollowThoseOfAll) {
  model::Model m = plain_model();
  m.effects.push_back(catalogue::blank_effect(catalogue::get("stribeck_gaussian"), data::Axis::rotary));
  const data::Dataset d = dataset_of({experiment("a", kFast, plain), experiment("b", kSlow, plain)});
  // One sample in 6 or in 13 is a row: every third is kept, or every sixth and rows fall between them.
  for (const double cutoff_hz : {40.0, 19.0}) {
    const auto found = identify(d, m, {cutoff_hz, true});
    RegressionProblem all(found->prepared, Balance::motor);
    const RegressionProblem decimated = all.decimated();
    EXPECT_LT(3 * decimated.prepared().records[0].inputs.size(), found->prepared.records[0].inputs.size() + 3);
    ASSERT_EQ(decimated.rows(), all.rows());
    EXPECT_EQ((decimated.target() - all.target()).norm(), 0.0);
    const std::vector<ParameterRef> refs =
        free_linear_parameters(found->terms, terms_on(found->terms, Balance::motor, {}));
    const Eigen::MatrixXd a = all.columns(found->terms, refs), b = decimated.columns(found->terms, refs);
    for (Eigen::Index j = 0; j < a.cols(); ++j)
      EXPECT_LT((a.col(j) - b.col(j)).norm(), 0.02 * a.col(j).norm()) << cutoff_hz << " Hz, column " << j;
  }
}

TEST(Minimise, WhatStandsAtABoundDoesNotHoldUpTheOthers) {
  // A narrow valley along y = 3 x that falls towards x = 2; x may go to 1.
  int asked = 0;
  const auto valley = [&](const std::vector<double>& x, Eigen::VectorXd& residuals, Eigen::MatrixXd* slopes) {
    ++asked;
    residuals = Eigen::Vector2d(x[0] - 2.0, 100.0 * (x[1] - 3.0 * x[0]));
    if (slopes) {
      slopes->resize(2, 2);
      *slopes << 1.0, 0.0, -300.0, 100.0;
    }
    return true;
  };
  std::vector<double> x{0.2, 2.0};
  Minimisation how;
  how.low = {0.0, 0.0};
  how.high = {1.0, 10.0};
  how.function_tolerance = how.parameter_tolerance = 1e-10;
  EXPECT_NEAR(minimise(x, 2, valley, how), 0.5, 1e-9);
  EXPECT_EQ(x[0], 1.0);
  EXPECT_NEAR(x[1], 3.0, 1e-7);
  EXPECT_LT(asked, 100);  // twice as often where it is cut back after each step
}

}  // namespace
}  // namespace flexspline::estimation::estimation_variable_projection_test
