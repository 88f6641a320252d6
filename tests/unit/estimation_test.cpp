// The estimators that a user chooses from: what each does on data whose truth is known, and what it refuses.
#include "host/engine/estimation/estimate.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/noisy_motor.hpp"

namespace flexspline::estimation::estimation_test {
namespace {

using estimation::Estimate;
using tests::noisy_motion;
using tests::NoisyMotor;

data::Dataset recorded(const NoisyMotor& motor, std::uint64_t seed = 5) {
  data::Dataset dataset;
  dataset.experiments.push_back(noisy_motion(motor, 1.6, 0.7, seed));
  dataset.experiments.push_back(noisy_motion(motor, 2.4, 1.9, seed + 1));
  return dataset;
}

NoisyMotor quiet() {
  NoisyMotor motor;
  motor.noise_share = 0.0;
  motor.duration_s = 3.0;
  return motor;
}

const estimation::PipelineOptions kFilters{40.0, true};

const Estimate& of(const Identification& found, std::string_view effect) {
  for (const Estimate& e : found.estimates)
    if (e.effect == effect) return e;
  throw std::out_of_range(std::string(effect));
}

bool warns_of(const Identification& found, std::string_view what) {
  for (const std::string& w : found.warnings)
    if (w.find(what) != std::string::npos) return true;
  return false;
}

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& refused) {
    return refused.what();
  }
  return "not refused";
}

TEST(Estimate, EveryMethodFindsTheTruthInDataWithoutNoise) {
  const NoisyMotor motor = quiet();
  for (const Method method :
       {Method::ls, Method::nls, Method::partitioned, Method::instruments, Method::output_error}) {
    Options how;
    how.method = method;
    const auto found = estimate(recorded(motor), tests::motor_model(motor), kFilters, how);
    EXPECT_NEAR(of(*found, "inertia").value / motor.inertia, 1.0, 2e-3) << name_of(method);
    EXPECT_NEAR(of(*found, "viscous_friction").value / motor.viscous, 1.0, 1e-2) << name_of(method);
    EXPECT_NEAR(of(*found, "coulomb_friction").value / motor.coulomb, 1.0, 3e-3) << name_of(method);
  }
}

TEST(Estimate, TheFreeRunDoesNotBeginAtTheNoiseOfTheFirstSample) {
  const NoisyMotor motor = quiet();
  data::Dataset dataset = recorded(motor);
  for (data::Experiment& e : dataset.experiments) e[data::Column::motor_velocity][0] += 20.0;  // rad/s, one sample
  Options how;
  how.method = Method::output_error;
  const auto found = estimate(dataset, tests::motor_model(motor), kFilters, how);
  EXPECT_NEAR(of(*found, "inertia").value / motor.inertia, 1.0, 2e-3);
  EXPECT_NEAR(of(*found, "coulomb_friction").value / motor.coulomb, 1.0, 5e-3);
}

// Report 3.6: with the torque constant open as well, any multiple of a solution is one.
TEST(Estimate, AnOpenScaleIsSaidAndOneSuppliedParameterClosesIt) {
  const NoisyMotor motor = quiet();
  model::Model model = tests::motor_model(motor);
  model.drive.torque_constant_nm_a.value = motor.torque_constant / 1.1;
  model.effects.push_back(catalogue::blank_effect(catalogue::get("torque_constant_error"), model.drive.axis));
  const auto open = estimate(recorded(motor), model, kFilters);
  EXPECT_FALSE(of(*open, "torque_constant_error").identifiable);
  EXPECT_TRUE(warns_of(*open, "--supply inertia.inertia=VALUE"));

  supply(model, {"inertia", "inertia", motor.inertia});
  const auto closed = estimate(recorded(motor), model, kFilters);
  EXPECT_TRUE(of(*closed, "torque_constant_error").identifiable);
  EXPECT_NEAR(of(*closed, "torque_constant_error").value, 0.1, 2e-3);
  EXPECT_NEAR(of(*closed, "coulomb_friction").value / motor.coulomb, 1.0, 5e-3);
  EXPECT_EQ(*closed->model.find("inertia")->find("inertia")->value, motor.inertia);
}

TEST(Estimate, SuppliedParametersThatAreNotThereAreRefusedWithTheNamesThatAre) {
  model::Model model = tests::motor_model({});
  EXPECT_NE(refusal([&] {
              supply(model, {"gravity", "sine", 1.0});
            }).find("it has inertia, viscous_friction"),
            std::string::npos);
  EXPECT_NE(refusal([&] { supply(model, {"inertia", "mass", 1.0}); }).find("it has inertia"), std::string::npos);
  EXPECT_NE(refusal([] { method_from_name("lsq"); }).find("partitioned"), std::string::npos);
  EXPECT_NE(refusal([] { intervals_from_name("wide"); }).find("bootstrap"), std::string::npos);
}

TEST(Estimate, LeastSquaresAloneRefusesFreeShapes) {
  model::Model model = tests::motor_model({});
  model.effects.push_back(catalogue::blank_effect(catalogue::get("stribeck_gaussian"), model.drive.axis));
  EXPECT_EQ(method_for(model), Method::nls);
  Options how;
  how.method = Method::ls;
  const std::string text = refusal([&] { estimate(recorded(quiet()), model, kFilters, how); });
  EXPECT_NE(text.find("--method nls"), std::string::npos) << text;
}

// Report 3.4: what the first part lacks goes into its parameters, so a partition is near the joint fit, not on it.
TEST(Estimate, ThePartitionKeepsItsLinearParametersThroughTheSearchForShapes) {
  NoisyMotor motor = quiet();
  motor.noise_share = 0.002;
  model::Model model = tests::motor_model(motor);
  Options how;
  how.method = Method::partitioned;
  const auto plain = estimate(recorded(motor), model, kFilters, how);
  model.effects.push_back(catalogue::blank_effect(catalogue::get("stribeck_gaussian"), model.drive.axis));
  const auto with_nonlinear = estimate(recorded(motor), model, kFilters, how);
  for (const char* name : {"inertia", "viscous_friction", "coulomb_friction"})
    EXPECT_NEAR(of(*with_nonlinear, name).value / of(*plain, name).value, 1.0, 1e-9) << name;
}

// For a linear model the sum of squares is a parabola: the profile's ends are the standard interval's.
// The standard one is wider by what twice the cut-off changes.
TEST(Estimate, ProfileIntervalsAgreeWithStandardErrorsForALinearModel) {
  NoisyMotor motor = quiet();
  motor.noise_share = 0.01;
  const auto standard = estimate(recorded(motor), tests::motor_model(motor), kFilters);
  Options how;
  how.intervals = Intervals::profile;
  const auto profile = estimate(recorded(motor), tests::motor_model(motor), kFilters, how);
  for (const char* name : {"inertia", "viscous_friction", "coulomb_friction"}) {
    const Estimate &s = of(*standard, name), &p = of(*profile, name);
    EXPECT_EQ(s.value, p.value);
    ASSERT_TRUE(p.low && p.high);
    EXPECT_NEAR(s.value - *p.low, *p.high - s.value, 0.02 * (*p.high - *p.low)) << name;
    const double by_noise = 2.0 * 1.959964 * *s.std;
    EXPECT_GT(*p.high - *p.low, 0.5 * by_noise) << name;
    EXPECT_LT(*p.high - *p.low, 2.0 * by_noise) << name;
    EXPECT_GE(*s.high - *s.low, (1.0 - 1e-6) * by_noise) << name;
  }
}

TEST(Estimate, BootstrapIntervalsHoldTheTruthAndComeOutTheSameForASeed) {
  NoisyMotor motor = quiet();
  motor.noise_share = 0.005;
  Options how;
  how.intervals = Intervals::bootstrap;
  how.replicates = 60;
  const auto once = estimate(recorded(motor), tests::motor_model(motor), kFilters, how);
  const auto again = estimate(recorded(motor), tests::motor_model(motor), kFilters, how);
  how.seed = 2;
  const auto other = estimate(recorded(motor), tests::motor_model(motor), kFilters, how);
  for (const char* name : {"inertia", "viscous_friction", "coulomb_friction"}) {
    const Estimate& e = of(*once, name);
    ASSERT_TRUE(e.low && e.high);
    EXPECT_LT(*e.low, e.value);
    EXPECT_GT(*e.high, e.value);
    EXPECT_LT(*e.high - *e.low, 0.1 * e.value) << name;
    EXPECT_EQ(*e.low, *of(*again, name).low);
    EXPECT_NE(*e.low, *of(*other, name).low);
  }
}

TEST(Estimate, ExcitationIsTheShareThatNoOtherParameterStandsInFor) {
  const NoisyMotor motor = quiet();
  const auto found = estimate(recorded(motor), tests::motor_model(motor), kFilters);
  for (const char* name : {"inertia", "viscous_friction", "coulomb_friction"}) {
    ASSERT_TRUE(of(*found, name).excitation);
    EXPECT_GT(*of(*found, name).excitation, 0.05) << name;
    EXPECT_LE(*of(*found, name).excitation, 1.0) << name;
  }
  // At one speed in one direction viscous and dry friction are one and the same.
  data::Dataset steady = recorded(motor);
  for (data::Experiment& e : steady.experiments)
    for (std::size_t k = 0; k < e.time_s.size(); ++k) {
      e[data::Column::motor_velocity][k] = 50.0 + 1e-3 * std::sin(0.05 * static_cast<double>(k));
      e[data::Column::current][k] = (motor.coulomb + 50.0 * motor.viscous) / motor.torque_constant;
    }
  const auto poor = estimate(steady, tests::motor_model(motor), kFilters);
  EXPECT_LT(of(*poor, "viscous_friction").excitation.value_or(0.0), 1e-3);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_test
