// What one-sided data cannot show: parameters of the direction that is missing, and an offset against an effect of the
// angle over a short travel. On motions that are written down.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/confounding.hpp"
#include "tests/support/plain_model.hpp"

namespace flexspline::selection {
namespace {

using data::Column;
using estimation::Balance;

constexpr double kTurn = 6.283185307179586;
const estimation::PipelineOptions kOptions{20.0, true};

// Inertia, viscous and Coulomb friction and something more over the angle, with noise of 1 % of the friction.
data::Experiment experiment(double amplitude_rad, double drift_rad_s, const std::function<double(double)>& more) {
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
    e[Column::motor_torque].push_back(1e-3 * a + 4e-3 * w + std::copysign(0.05, w) + more(q) + noise(random));
  }
  e.segments = {{0, e.size()}};
  return e;
}

// Which of the two amplitudes of Stribeck friction and its velocity are known, after the missing direction was left
// out.
std::vector<std::uint8_t> known_on(double amplitude_rad, double drift_rad_s) {
  const data::Experiment e = experiment(amplitude_rad, drift_rad_s, [](double) { return 0.0; });
  const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
  Terms terms = extend(estimation::terms_of(testing::plain_model()), catalogue::get("stribeck_gaussian"), std::nullopt);
  leave_out_unseen_direction(RegressionProblem(prepared, Balance::motor), terms);
  for (std::size_t p = 0; p < 2; ++p) EXPECT_TRUE(terms.back().known[p] == 0 || terms.back().values[p] == 0.0);
  return terms.back().known;
}

TEST(UnseenDirection, LeavesOutTheAmplitudeThatNoSampleShows) {
  EXPECT_EQ(known_on(1.0, 20.0), (std::vector<std::uint8_t>{0, 1, 0})) << "forward only";
  EXPECT_EQ(known_on(1.0, -20.0), (std::vector<std::uint8_t>{1, 0, 0})) << "backward only";
  EXPECT_EQ(known_on(20.0, 0.0), (std::vector<std::uint8_t>{0, 0, 0})) << "both ways";
}

// Whether an offset and gravity are one group on such a record.
bool are_confounded(double amplitude_rad, const std::function<double(double)>& more) {
  const data::Experiment e = experiment(amplitude_rad, 0.0, more);
  const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
  RegressionProblem data(prepared, Balance::motor);
  const Terms terms = estimation::terms_of(testing::plain_model());
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
}  // namespace flexspline::selection
