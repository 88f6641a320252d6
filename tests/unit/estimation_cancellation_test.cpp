// A fit that is cancelled: it checks the cancellation token again and again, and what that throws ends it.
#include "host/engine/estimation/cancellation.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/minimise.hpp"
#include "host/engine/selection/add.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::estimation::estimation_cancellation_test {
namespace {

using plant::Mode;
using plant::Waveform;

struct Enough {};

struct Case {
  data::Dataset dataset;
  model::Model model;
};
const Case& a_case() {
  static const Case made = [] {
    const plant::Drive drive = plant::demo_plant().drive;
    return Case{comparison::record(drive,
                                   {comparison::plan("free", Mode::velocity, Waveform::sine, 60.0, 1.0, 3.0),
                                    comparison::plan("slow", Mode::velocity, Waveform::sine, 5.0, 0.5, 4.0)},
                                   1),
                comparison::known_model(drive)};
  }();
  return made;
}

// How often the cancellation token is checked while an effect with nonlinear parameters is added; the check of this
// number throws (zero: none does).
int checks_until(int last) {
  std::atomic<int> count{0};
  const CancellationCheck check = [&] {
    if (++count == last) throw Enough{};
  };
  const CancellationScope scope(&check);
  const auto add = [] { selection::add(a_case().dataset, a_case().model, "stribeck_gaussian", {}); };
  if (last == 0) {
    add();
  } else {
    EXPECT_THROW(add(), Enough) << "at check " << last;
  }
  return count;
}

TEST(Cancellation, AFitEndsWhereItIsNoLongerWantedWhetherEarlyOrLate) {
  const int whole = checks_until(0);
  // Each record and each set of columns, of the fit before and of the one after.
  ASSERT_GT(whole, 40);
  for (const int last : {1, whole / 4, whole / 2, 3 * whole / 4}) {
    const int checks = checks_until(last);
    EXPECT_GE(checks, last);
    EXPECT_LT(checks, whole) << "the rest was done all the same";
  }
}

TEST(Cancellation, TheCheckEndsWithItsScope) {
  int count = 0;
  const CancellationCheck check = [&] { ++count; };
  {
    const CancellationScope outer(&check);
    const CancellationCheck other = [] {};
    {
      const CancellationScope inner(&other);
      throw_if_cancelled();
    }
    EXPECT_EQ(count, 0);
    throw_if_cancelled();
    EXPECT_EQ(count, 1);
  }
  throw_if_cancelled();
  EXPECT_EQ(count, 1);
}

TEST(Cancellation, WhatResidualsThrowComesOutOfTheSearchAsItIs) {
  std::vector<double> x{5.0};
  int calls = 0;
  const Residuals residuals = [&](const std::vector<double>& at, Eigen::VectorXd& r, Eigen::MatrixXd* slopes) {
    if (++calls == 3) throw Enough{};
    r = Eigen::VectorXd::Constant(1, std::exp(at[0]) - 1.0);
    if (slopes != nullptr) *slopes = Eigen::MatrixXd::Constant(1, 1, std::exp(at[0]));
    return true;
  };
  EXPECT_THROW(minimise(x, 1, residuals, {}), Enough);
  EXPECT_EQ(calls, 3) << "the search went on";
}

}  // namespace
}  // namespace flexspline::estimation::estimation_cancellation_test
