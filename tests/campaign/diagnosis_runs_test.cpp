// Diagnosis of several runs: friction that differs between them, and effects added until nothing is missing.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/add_until_complete.hpp"

namespace flexspline::selection::diagnosis_runs_test {
namespace {

using data::Column;

constexpr double kPi = 3.14159265358979323846;
constexpr double kInertia = 1e-3, kViscous = 4e-3, kCoulomb = 0.05;
using Extra = std::function<double(double q, double w)>;

// Six runs of motions and torques that are written down, not simulated; viscous and dry friction of each times its own
// factors.
data::Dataset runs(double variation, unsigned seed, const Extra& extra) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  data::Dataset dataset;
  for (int run = 0; run < 6; ++run) {
    const double viscous = kViscous * (1.0 + variation * normal(random)),
                 dry = kCoulomb * (1.0 + variation * normal(random));
    data::Experiment e;
    e.name = "run " + std::to_string(run);
    e.sample_s = 1e-3;
    e.current_hold = data::CurrentHold::none;
    for (std::size_t k = 0; k < 4000; ++k) {
      const double t = 1e-3 * static_cast<double>(k);
      std::array<double, 3> m{};
      for (const auto& [amplitude, frequency_hz] : {std::pair{2.0 + run, 0.9123}, {0.5, 2.7183}, {0.8, 0.3717}}) {
        const double rate = 2.0 * kPi * frequency_hz, angle = rate * t + run * frequency_hz;
        m[0] += amplitude * std::sin(angle);
        m[1] += amplitude * rate * std::cos(angle);
        m[2] -= amplitude * rate * rate * std::sin(angle);
      }
      e.time_s.push_back(t);
      e[Column::motor_position].push_back(m[0]);
      e[Column::motor_torque].push_back(kInertia * m[2] + viscous * m[1] + std::copysign(dry, m[1]) +
                                        extra(m[0], m[1]) + 0.002 * normal(random));
    }
    e.segments = {{0, e.size()}};
    dataset.experiments.push_back(std::move(e));
  }
  return dataset;
}

double none(double, double) {
  return 0.0;
}
double asymmetry(double, double w) {
  return 2e-4 * std::abs(w);
}

model::Model model_of(const std::vector<std::string>& effects) {
  model::Model m;
  for (const std::string& name : effects)
    m.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return m;
}
const std::vector<std::string> kPlain{"inertia", "viscous_friction", "coulomb_friction"};

Options options() {
  Options o;
  o.pipeline = {40.0, true};
  return o;
}

TEST(DiagnoseRuns, FrictionThatDiffersBetweenThemIsSaidAndNamesNothing) {
  const Diagnosis d = diagnose(runs(0.1, 1, none), model_of(kPlain), options());
  EXPECT_TRUE(d.named.empty());
  ASSERT_EQ(d.friction_drift.size(), 2u);
  EXPECT_EQ(d.friction_drift[0].group, "viscous friction");
  for (const Drift& drift : d.friction_drift) {
    EXPECT_GT(drift.percent, 4.0);
    EXPECT_LT(drift.percent, 20.0);
  }
  EXPECT_FALSE(d.warnings.empty());
}

TEST(DiagnoseRuns, FrictionThatIsTheSameInThemIsNoDrift) {
  EXPECT_TRUE(diagnose(runs(0.0, 2, none), model_of(kPlain), options()).friction_drift.empty());
}

TEST(DiagnoseRuns, AnEffectIsNamedAmongRunsThatDiffer) {
  const Diagnosis d = diagnose(runs(0.1, 3, asymmetry), model_of(kPlain), options());
  ASSERT_EQ(d.named.size(), 1u);
  EXPECT_EQ(d.named[0].effect, "viscous_asymmetry");
  EXPECT_NEAR(d.candidates.front().parameters[0].value, 2e-4, 1e-5);
}

TEST(Complete, AddsWhatIsMissingAndStops) {
  const StepwiseSelection done = add_until_complete(runs(0.0, 4, asymmetry), model_of(kPlain), options(), 5);
  ASSERT_EQ(done.rounds.size(), 2u);
  EXPECT_EQ(done.rounds[0].named.at(0).effect, "viscous_asymmetry");
  EXPECT_NE(done.rounds[1].verdict, Verdict::missing_effect);
  EXPECT_TRUE(done.model.find("viscous_asymmetry"));
  EXPECT_TRUE(done.removed.empty());
}

TEST(Complete, DoesNotAddWhatTakesOffAThousandthOfTheFirstFall) {
  // Beside an asymmetry a thousand times as large (by squares), which leaves no doubt of it either.
  const auto both = [](double q, double w) { return 8e-4 * std::abs(w) + 4e-4 * std::cos(5.0 * q); };
  const data::Dataset dataset = runs(0.0, 5, both);
  const StepwiseSelection done = add_until_complete(dataset, model_of(kPlain), options(), 5);
  ASSERT_EQ(done.rounds.size(), 2u);
  EXPECT_FALSE(done.model.find("torque_ripple"));
  const Diagnosis next = diagnose(dataset, done.model, options());
  ASSERT_EQ(next.named.size(), 1u);
  EXPECT_EQ(next.named[0].effect, "torque_ripple");
}

TEST(LeastSignificantEffect, IsTheEffectThatTheDataDoNotShow) {
  const data::Dataset dataset = runs(0.0, 6, asymmetry);
  const model::Model model =
      model_of({"inertia", "viscous_friction", "coulomb_friction", "viscous_asymmetry", "coulomb_asymmetry"});
  EXPECT_EQ(least_significant_effect(dataset, model, {"viscous_asymmetry", "coulomb_asymmetry"}, options()),
            "coulomb_asymmetry");
  EXPECT_EQ(least_significant_effect(dataset, model, {"viscous_asymmetry"}, options()), "");
  EXPECT_EQ(least_significant_effect(dataset, model, {}, options()), "");
}

}  // namespace
}  // namespace flexspline::selection::diagnosis_runs_test
