// Checks of what a fit would name although the data are too short or too one-sided to show it, on motions that are
// written down.
#include "host/engine/selection/significance_checks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/plain_model.hpp"
#include "tests/support/ripple_candidate.hpp"
#include "tests/support/two_sines.hpp"

namespace flexspline::selection::selection_significance_checks_test {
namespace {

using estimation::Balance;

const estimation::PipelineOptions kOptions{20.0, true};

double ripple(double, double q) {
  return 0.02 * std::cos(3.0 * q + 0.4);
}

// The ripple of three a turn as a candidate on such a record, checked. Its gain is kept in the rows from `first` to
// `last`, shares of all, alone.
CandidateFit checked(const data::Experiment& e, double first = 0.0, double last = 1.0) {
  const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
  RegressionProblem data(prepared, Balance::motor);
  const Terms terms = estimation::terms_of(tests::plain_model());
  const Eigen::VectorXd keep = Eigen::VectorXd::Ones(data.rows());
  BalanceSearch search{&data, keep, cross_validate(data, terms, keep)};
  CandidateFit candidate = tests::ripple_candidate(search, 3.0, keep);
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
  const CandidateFit candidate = checked(tests::two_sines(20.0, 0.0, ripple));
  EXPECT_TRUE(candidate.admissible) << candidate.why_not;
  EXPECT_TRUE(candidate.note.empty());
}

TEST(CheckOrders, AFractionOfATurnCannotTellAnOrderFromOneThatNoDriveHas) {
  const CandidateFit candidate = checked(tests::two_sines(0.5, 0.0, ripple));
  EXPECT_FALSE(candidate.admissible);
  EXPECT_NE(candidate.why_not.find("too short to distinguish orders"), std::string::npos) << candidate.why_not;
}

TEST(CheckOrders, WhatShowsInAFewPartsOfTheDataIsNoPropertyOfTheDrive) {
  const CandidateFit few = checked(tests::two_sines(20.0, 0.0, ripple), 0.25, 0.7);
  EXPECT_FALSE(few.admissible);
  EXPECT_EQ(few.why_not, "it shows in 4 of 8 parts of the data only");
  EXPECT_TRUE(checked(tests::two_sines(20.0, 0.0, ripple), 0.125, 0.95).admissible) << "seven parts are enough";
}

TEST(OneDirectionWarning, IsGivenWhereTheAxisHardlyComesBack) {
  const auto warning = [](double amplitude_rad, double drift_rad_s) {
    const data::Experiment e = tests::two_sines(amplitude_rad, drift_rad_s, ripple);
    const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
    return one_direction_warning(RegressionProblem(prepared, Balance::motor));
  };
  EXPECT_EQ(warning(20.0, 0.0), "");
  EXPECT_NE(warning(1.0, 20.0).find("moves forward in 100.0 %"), std::string::npos) << warning(1.0, 20.0);
  EXPECT_NE(warning(1.0, -20.0).find("moves backward"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::selection::selection_significance_checks_test
