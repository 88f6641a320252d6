// Of several names each has to gain something while the others are in the model: torques that are written down, with a
// drag that grows with the square of the speed.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/selection/joint_names.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::joint_names_test {
namespace {

using data::Column;

const NamedEffect kDrag{"quadratic_drag", std::nullopt}, kStribeck{"stribeck_gaussian", std::nullopt};

// An axis with that drag, and as much of `stribeck_nm` at standstill.
struct Axis {
  explicit Axis(double stribeck_nm) {
    std::mt19937_64 random(11);
    std::normal_distribution<double> noise(0.0, 1.0);
    for (const double hz : {0.3, 0.5, 0.8})
      dataset.experiments.push_back(
          tests::written_experiment(std::to_string(hz), 2e-3, 6000, [&](double t, data::Experiment& e) {
            const double rate = kTurn * hz, q = 30.0 * std::sin(rate * t), w = 30.0 * rate * std::cos(rate * t);
            const double direction = w > 0.0 ? 1.0 : -1.0;
            e[Column::motor_position].push_back(q);
            e[Column::motor_torque].push_back(
                -1e-4 * rate * rate * q + 1e-3 * w + 0.05 * direction + 2e-6 * w * std::abs(w) +
                stribeck_nm * std::exp(-w * w / 400.0) * direction + 5e-4 * noise(random));
          }));
    identified = estimation::identify(dataset, tests::plain_model(), {});
    const RegressionProblem& data = identified->data.front();
    motor.search = {&data, Eigen::VectorXd::Ones(data.rows()), {}};
    motor.search.base = cross_validate(data, identified->terms, motor.search.keep);
    motor.candidates = rank_candidates(motor.search);
  }
  data::Dataset dataset;
  std::unique_ptr<estimation::Identification> identified;
  SearchedBalance motor;
};

class NamesTogether : public ::testing::Test {
 protected:
  // The search takes longest, so all tests look at one of each.
  static SearchedBalance& with_drag_alone() {
    static Axis axis(0.0);
    return axis.motor;
  }
  static const SearchedBalance& with_both() {
    static const Axis axis(0.02);
    return axis.motor;
  }
  static Resampling found(const std::vector<NamedEffect>& names) {
    Resampling resampling;
    for (const NamedEffect& n : names) {
      Resampling::FoundTerm& one = resampling.found.emplace_back();
      one.group = {n};
      one.frequency = 0.8;
    }
    return resampling;
  }
  static std::vector<std::string> effects(const std::vector<NamedEffect>& names) {
    std::vector<std::string> list;
    for (const NamedEffect& n : names) list.push_back(n.effect);
    return list;
  }
};

TEST_F(NamesTogether, WhatOnlyResemblesTheTrueOneIsTakenOff) {
  const JointNames joint = eliminate_backward(found({kDrag, kStribeck}), with_drag_alone(), {kStribeck, kDrag});
  EXPECT_EQ(effects(joint.names), std::vector<std::string>{"quadratic_drag"});
  EXPECT_EQ(effects(joint.eliminated), std::vector<std::string>{"stribeck_gaussian"});
}

TEST_F(NamesTogether, ThoseThatAreBothThereStay) {
  const JointNames joint = eliminate_backward(found({kDrag, kStribeck}), with_both(), {kStribeck, kDrag});
  EXPECT_EQ(effects(joint.names), (std::vector<std::string>{"stribeck_gaussian", "quadratic_drag"}));
  EXPECT_TRUE(joint.eliminated.empty());
}

TEST_F(NamesTogether, TheLikeliestReplacesWhatItMakesNeedlessWhereHalvesChoseIt) {
  const SearchedBalance& motor = with_drag_alone();
  EXPECT_EQ(effects(eliminate_backward(found({kStribeck, kDrag}), motor, {kStribeck}).names),
            std::vector<std::string>{"quadratic_drag"});
  const JointNames unchosen = eliminate_backward(found({kStribeck}), motor, {kStribeck});
  EXPECT_TRUE(unchosen.names.empty());
  EXPECT_EQ(effects(unchosen.eliminated), std::vector<std::string>{"stribeck_gaussian"});
}

// The likeliest has a memory, say, so that halves cannot choose it.
TEST_F(NamesTogether, TheLikeliestThatHalvesCannotJudgeIsAGroupWithWhatTheCatalogueHasAsConfused) {
  const NamedEffect power{"power_law_friction", std::nullopt};
  const SearchedBalance& motor = with_drag_alone();
  const JointNames joint = eliminate_backward(found({power}), motor, {power});
  EXPECT_TRUE(joint.is_group);
  EXPECT_EQ(effects(joint.names), (std::vector<std::string>{"power_law_friction", "quadratic_drag"}));
  Resampling judged = found({power});
  judged.support = {{"quadratic_drag", std::nullopt, 0.2}};
  EXPECT_FALSE(eliminate_backward(judged, motor, {power}).is_group);
}

TEST_F(NamesTogether, HeldOutExperimentsDecideWhetherItReplacesWhereThereAreAny) {
  SearchedBalance& motor = with_drag_alone();
  motor.candidates.front().held_out_ratio = 0.999;
  EXPECT_TRUE(eliminate_backward(found({kStribeck, kDrag}), motor, {kStribeck}).names.empty());
  motor.candidates.front().held_out_ratio = 0.7;
  EXPECT_EQ(effects(eliminate_backward(found({kStribeck}), motor, {kStribeck}).names),
            std::vector<std::string>{"quadratic_drag"});
  motor.candidates.front().held_out_ratio.reset();  // as the other tests have it
}

TEST_F(NamesTogether, PreslidingIsNotJudgedAndASingleNameStays) {
  const NamedEffect presliding{"dahl_friction", std::nullopt};
  const SearchedBalance& motor = with_drag_alone();
  EXPECT_EQ(eliminate_backward(found({presliding, kDrag}), motor, {presliding, kDrag}).names.size(), 2U);
  EXPECT_EQ(eliminate_backward(found({kDrag}), motor, {kDrag}).names.size(), 1U);
  EXPECT_TRUE(eliminate_backward({}, motor, {}).names.empty());
}

}  // namespace
}  // namespace flexspline::selection::joint_names_test
