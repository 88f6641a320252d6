// What encoders do to a torsion, and what they must not be taken for, on torques that are written down.
#include "host/engine/selection/encoder_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "host/engine/estimation/terms.hpp"

namespace flexspline::selection::encoder_errors_test {
namespace {

using data::Column;
using estimation::Balance;

constexpr double kPi = 3.14159265358979323846, kGear = 100.0, kStiffness = 1e4, kGravity = 8.0;

struct Gear {
  double inertia = 0.6;            // kg m^2, of the load
  double quadratic = 0.0;          // N m/rad^2
  double hysteresis = 0.0;         // N m, Dahl's
  double eccentricity = 0.0;       // rad, of the output's encoder
  double step = 0.0;               // rad, likewise
  std::uint64_t noise = 12345ULL;  // seed of the torque sensor's
  int samples = 8000;              // of a record, 2 ms apart
};

// A joint that swings its load by `swing` rad: the torsion follows from the load, the torque from the torsion.
data::Experiment swinging(int index, const Gear& gear) {
  data::Experiment e;
  e.name = "swing-" + std::to_string(index);
  e.sample_s = 2e-3;
  e.load = data::Load::free;
  e.current_hold = data::CurrentHold::none;
  double loop = 0.0, before = 0.0;
  std::uint64_t random = gear.noise + static_cast<std::uint64_t>(index);
  const auto uniform = [&random] {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(random >> 11) / 9007199254740992.0 - 0.5;
  };
  for (int k = 0; k < gear.samples; ++k) {
    const double t = 2e-3 * k, w1 = 2.0 * kPi * (0.21 + 0.06 * index), w2 = 2.0 * kPi * 1.3;
    const double q = 0.45 * std::sin(w1 * t + 0.7 * index) + 0.06 * std::sin(w2 * t + index);
    const double a = -0.45 * w1 * w1 * std::sin(w1 * t + 0.7 * index) - 0.06 * w2 * w2 * std::sin(w2 * t + index);
    const double x = (kGravity * std::sin(q) + gear.inertia * a) / kStiffness;
    if (gear.hysteresis > 0.0 && x != before) {
      const double end = std::copysign(gear.hysteresis, x - before);
      loop = end + (loop - end) * std::exp(-std::abs(x - before) / 2e-5);
    }
    before = x;
    const double seen = q + gear.eccentricity * std::sin(q + 1.0);
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(kGear * (q + x));
    e[Column::output_position].push_back(gear.step > 0.0 ? gear.step * std::round(seen / gear.step) : seen);
    e[Column::motor_torque].push_back(0.0);
    e[Column::torque].push_back(kStiffness * x + gear.quadratic * x * x + loop + 0.02 * uniform());
  }
  const std::size_t count = e.time_s.size();
  e.segments = {{0, count}};
  e.masked.assign(count, 0);
  return e;
}

// The candidate for this effect on three such records, checked; nothing where it would not be named before.
std::optional<CandidateFit> checked(std::string_view effect, const Gear& gear) {
  model::Model spring;
  spring.drive.gear_ratio.value = kGear;
  spring.drive.torque_constant_nm_a.value = 0.05;
  for (const char* type : {"linear_stiffness", "torque_offset"})
    spring.effects.push_back(catalogue::blank_effect(catalogue::get(type), data::Axis::rotary));
  const std::vector<data::Experiment> records = {swinging(0, gear), swinging(1, gear), swinging(2, gear)};
  const estimation::PreparedData prepared =
      estimation::prepare({&records[0], &records[1], &records[2]}, spring, {20.0, true});
  RegressionProblem data(prepared, Balance::transmission);
  const Eigen::VectorXd keep = Eigen::VectorXd::Ones(data.rows());
  const BalanceSearch search{&data, keep, cross_validate(data, estimation::terms_of(spring), keep)};
  std::vector<CandidateFit> candidates =
      rank_candidates(search, [&](const CandidateModel& m) { return m.entry->name() == effect; });
  if (candidates.size() != 1 || !passes(candidates.front())) return std::nullopt;
  check_encoder_errors(search, candidates);
  return candidates.front();
}

TEST(CheckEncoderErrors, AnEccentricDiscIsNoStiffnessThatDiffersByDirection) {
  const auto candidate = checked("quadratic_stiffness", {.inertia = 0.1, .eccentricity = 2e-5});
  ASSERT_TRUE(candidate) << "else nothing is checked";
  EXPECT_FALSE(candidate->admissible);
  EXPECT_NE(candidate->why_not.find("eccentric"), std::string::npos) << candidate->why_not;
}

TEST(CheckEncoderErrors, AStiffnessThatDiffersByDirectionStaysWithAnEccentricDiscOrWithout) {
  for (const double eccentricity : {0.0, 2e-5}) {
    const auto candidate = checked("quadratic_stiffness", {.quadratic = 1e6, .eccentricity = eccentricity});
    ASSERT_TRUE(candidate);
    EXPECT_TRUE(passes(*candidate)) << candidate->why_not;
  }
}

TEST(CheckEncoderErrors, ALoopSmallerThanTheStepsOfTheEncodersIsNotSeen) {
  // Steps of 1e-4 rad are 1 N m of this spring, 0.29 N m in root mean square.
  for (const int samples : {2000, 8000}) {
    const auto small = checked("dahl_hysteresis", {.hysteresis = 0.15, .step = 1e-4, .samples = samples});
    ASSERT_TRUE(small) << "else nothing is checked";
    EXPECT_FALSE(small->admissible);
    EXPECT_NE(small->why_not.find("steps of the encoders"), std::string::npos) << small->why_not;
  }
}

TEST(CheckEncoderErrors, ALoopLargerThanTheStepsStays) {
  // Records on which the smaller loop above is refused; on longer ones the search takes a minute under the sanitizers.
  const auto large = checked("dahl_hysteresis", {.hysteresis = 1.0, .step = 1e-4, .samples = 2000});
  ASSERT_TRUE(large);
  EXPECT_TRUE(passes(*large)) << large->why_not;
}

}  // namespace
}  // namespace flexspline::selection::encoder_errors_test
