// What one-sided data cannot show: parameters of the direction that is missing, and an offset against an effect of the
// angle over a short travel. On motions that are written down.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/confounding.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/two_sines.hpp"

namespace flexspline::selection::selection_one_sided_data_test {
namespace {

using estimation::Balance;

const estimation::PipelineOptions kOptions{20.0, true};

// Which of the two amplitudes of Stribeck friction and its velocity are known, after the missing direction was left
// out.
std::vector<std::uint8_t> known_on(double amplitude_rad, double drift_rad_s) {
  const data::Experiment e = tests::two_sines(amplitude_rad, drift_rad_s, [](double, double) { return 0.0; });
  const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
  Terms terms = extend(estimation::terms_of(tests::plain_model()), catalogue::get("stribeck_gaussian"), std::nullopt);
  leave_out_unseen_direction(RegressionProblem(prepared, Balance::motor), terms);
  for (std::size_t p = 0; p < 2; ++p) EXPECT_TRUE(terms.back().known[p] == 0 || terms.back().values[p] == 0.0);
  return terms.back().known;
}

TEST(UnseenDirection, LeavesOutTheAmplitudeThatNoSampleShows) {
  EXPECT_EQ(known_on(1.0, 20.0), (std::vector<std::uint8_t>{0, 1, 0})) << "forward only";
  EXPECT_EQ(known_on(1.0, -20.0), (std::vector<std::uint8_t>{1, 0, 0})) << "backward only";
  EXPECT_EQ(known_on(20.0, 0.0), (std::vector<std::uint8_t>{0, 0, 0})) << "both ways";
}

// Whether an asymmetry may be seen on one record that moves forward alone and one that moves both ways.
bool asymmetry_is_seen(data::Role role_of_both_ways) {
  const auto none = [](double, double) { return 0.0; };
  data::Experiment forward = tests::two_sines(1.0, 20.0, none), both_ways = tests::two_sines(20.0, 0.0, none);
  both_ways.role = role_of_both_ways;
  const estimation::PreparedData prepared = estimation::prepare({&forward, &both_ways}, {}, kOptions);
  return may_be_seen(RegressionProblem(prepared, Balance::motor), estimation::terms_of(tests::plain_model()),
                     catalogue::get("coulomb_asymmetry"));
}

TEST(Directions, ThatHeldOutRecordsAloneShowAreNotSeen) {
  EXPECT_TRUE(asymmetry_is_seen(data::Role::fit));
  EXPECT_FALSE(asymmetry_is_seen(data::Role::holdout));
}

// Whether an offset and gravity are one group on such a record.
bool are_confounded(double amplitude_rad, const std::function<double(double)>& more) {
  const data::Experiment e = tests::two_sines(amplitude_rad, 0.0, [&](double, double q) { return more(q); });
  const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
  RegressionProblem data(prepared, Balance::motor);
  const Terms terms = estimation::terms_of(tests::plain_model());
  const Eigen::VectorXd keep = Eigen::VectorXd::Ones(data.rows());
  BalanceSearch search{&data, keep, cross_validate(data, terms, keep)};
  const std::vector<CandidateFit> candidates = rank_candidates(search);
  const auto of = [&](std::string_view name) {
    return std::find_if(candidates.begin(), candidates.end(),
                        [&](const CandidateFit& t) { return t.model.entry->name() == name; });
  };
  const auto offset = of("torque_bias"), gravity = of("gravity");
  EXPECT_TRUE(offset != candidates.end() && gravity != candidates.end());
  return is_angle_confounded(*offset, *gravity);
}

TEST(OffsetAndGravity, CannotBeDistinguishedOverAShortTravel) {
  EXPECT_TRUE(are_confounded(0.05, [](double q) { return 0.05 * std::cos(q); })) << "gravity";
}

TEST(OffsetAndGravity, AreDistinguishedOverALongTravel) {
  EXPECT_FALSE(are_confounded(3.0, [](double) { return 0.05; })) << "an offset";
}

}  // namespace
}  // namespace flexspline::selection::selection_one_sided_data_test
