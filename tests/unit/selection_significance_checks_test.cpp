// Checks of what a fit would name although the data are too short or too one-sided to show it, on motions that are
// written down.
#include "host/engine/selection/significance_checks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/support/plain_model.hpp"
#include "tests/support/ripple_candidate.hpp"

namespace flexspline::selection {
namespace {

using data::Column;
using estimation::Balance;

constexpr double kTurn = 6.283185307179586;
const estimation::PipelineOptions kOptions{20.0, true};

// Inertia, viscous and Coulomb friction, and something more, with noise of 1 % of the friction.
data::Experiment experiment(double amplitude_rad, double drift_rad_s,
                            const std::function<double(double t, double q)>& more) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 5e-4);
  data::Experiment e;
  e.name = "written down";
  e.sample_s = 2e-3;
  e.current_hold = data::CurrentHold::none;
  for (std::size_t k = 0; k < 6000; ++k) {
    const double t = 2e-3 * static_cast<double>(k);
    double q = drift_rad_s * t, w = drift_rad_s, a = 0.0;
    for (const auto& [share, frequency_hz] : {std::pair{0.7, 0.2123}, {0.3, 0.7183}}) {
      const double rate = kTurn * frequency_hz;
      q += share * amplitude_rad * std::sin(rate * t);
      w += share * amplitude_rad * rate * std::cos(rate * t);
      a -= share * amplitude_rad * rate * rate * std::sin(rate * t);
    }
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(1e-3 * a + 4e-3 * w + std::copysign(0.05, w) + more(t, q) + noise(random));
  }
  e.segments = {{0, e.size()}};
  return e;
}

double ripple(double, double q) {
  return 0.02 * std::cos(3.0 * q + 0.4);
}

// The ripple of three a turn as a candidate on such a record, checked. Its gain is kept in the rows from `first` to
// `last`, shares of all, alone.
CandidateFit checked(const data::Experiment& e, double first = 0.0, double last = 1.0) {
  const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
  RegressionProblem data(prepared, Balance::motor);
  const Terms terms = estimation::terms_of(testing::plain_model());
  const Eigen::VectorXd keep = Eigen::VectorXd::Ones(data.rows());
  BalanceSearch search{&data, keep, cross_validate(data, terms, keep)};
  CandidateFit candidate = testing::ripple_candidate(search, 3.0, keep);
  EXPECT_TRUE(passes(candidate)) << "else nothing is checked";
  const Eigen::Index rows = data.rows();
  for (Eigen::Index k = 0; k < rows; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(rows);
    if (share < first || share >= last) candidate.fit.residual[k] = search.base.residual[k];
  }
  std::vector<CandidateFit> candidates{candidate};
  check_orders({&search}, search, candidates);
  return candidates.front();
}

TEST(CheckOrders, AnOrderThatManyTurnsShowPasses) {
  const CandidateFit candidate = checked(experiment(20.0, 0.0, ripple));
  EXPECT_TRUE(candidate.admissible) << candidate.why_not;
  EXPECT_TRUE(candidate.note.empty());
}

TEST(CheckOrders, AFractionOfATurnCannotTellAnOrderFromOneThatNoDriveHas) {
  const CandidateFit candidate = checked(experiment(0.5, 0.0, ripple));
  EXPECT_FALSE(candidate.admissible);
  EXPECT_NE(candidate.why_not.find("too short to distinguish orders"), std::string::npos) << candidate.why_not;
}

TEST(CheckOrders, WhatShowsInAFewPartsOfTheDataIsNoPropertyOfTheDrive) {
  const CandidateFit few = checked(experiment(20.0, 0.0, ripple), 0.25, 0.7);
  EXPECT_FALSE(few.admissible);
  EXPECT_EQ(few.why_not, "it shows in 4 of 8 parts of the data only");
  EXPECT_TRUE(checked(experiment(20.0, 0.0, ripple), 0.125, 0.95).admissible) << "seven parts are enough";
}

TEST(OneDirectionWarning, IsGivenWhereTheAxisHardlyComesBack) {
  const auto warning = [](double amplitude_rad, double drift_rad_s) {
    const data::Experiment e = experiment(amplitude_rad, drift_rad_s, ripple);
    const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
    return one_direction_warning(RegressionProblem(prepared, Balance::motor));
  };
  EXPECT_EQ(warning(20.0, 0.0), "");
  EXPECT_NE(warning(1.0, 20.0).find("moves forward in 100.0 %"), std::string::npos) << warning(1.0, 20.0);
  EXPECT_NE(warning(1.0, -20.0).find("moves backward"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::selection
