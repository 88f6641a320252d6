// The report's DC motor against closed forms and against the report's own observations.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>

#include "hil/thesis_models/dc_motor.hpp"
#include "hil/thesis_models/friction_block.hpp"
#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/runge_kutta.hpp"

namespace flexspline::report_motor_test {
namespace {

using namespace flexspline::report;  // NOLINT(google-build-using-namespace): a test reads better without the prefix

constexpr double kStep = published::kSampleS;

struct Motion {
  double angle = 0.0;
  double velocity = 0.0;
};

// Figure 6 under a constant current and output torque, by the report's Runge-Kutta method.
Motion turn(const DcMotor& motor, const FrictionBlock& friction, Motion from, double current, double output, int steps,
            double step_s = kStep) {
  const auto rate = [&](double, const std::array<double, 2>& y) {
    const double driving = motor.driving_torque(current, output);
    return std::array{y[1], motor.acceleration(current, output, friction.torque(y[1], driving))};
  };
  std::array y{from.angle, from.velocity};
  for (int n = 0; n < steps; ++n) y = rk4_step(rate, n * step_s, y, step_s);
  return {y[0], y[1]};
}

std::unique_ptr<FrictionBlock> block(const DcMotor& motor, FrictionMethod method = FrictionMethod::boundary_layer,
                                     double step_s = kStep) {
  return make_friction_block(method, {motor.inertia, {motor.friction}}, step_s);
}

DcMotor viscous_motor(double inertia, double viscous) {
  return {0.1, 10.0, inertia, FrictionCurve::symmetric({viscous, 0.0, 0.0, 1.0})};
}

TEST(ReportMotor, SpinsUpExponentiallyUnderViscousFriction) {
  const DcMotor motor = viscous_motor(1e-4, 1e-3);
  const auto friction = block(motor, FrictionMethod::threshold_1e_8);
  for (const int steps : {10, 100, 1000}) {
    const double t = steps * kStep;
    const double expected = 0.1 * 2.0 / 1e-3 * (1.0 - std::exp(-t / 0.1));
    // Ten thousandths of the time constant per step: the fourth-order method errs by less than 1e-9 of the end speed.
    EXPECT_NEAR(turn(motor, *friction, {}, 2.0, 0.0, steps).velocity, expected, 200.0 * 1e-9);
  }
}

TEST(ReportMotor, RungeKuttaErrsWithTheFourthPowerOfTheStep) {
  const DcMotor motor = viscous_motor(1e-4, 1e-2);  // table 1: a time constant of 10 ms
  const double exact = 10.0 * (1.0 - std::exp(-1.0));
  const auto error = [&](int steps) {
    const double step = 1e-2 / steps;
    const auto friction = block(motor, FrictionMethod::threshold_1e_8, step);
    return std::abs(turn(motor, *friction, {}, 1.0, 0.0, steps, step).velocity - exact);
  };
  for (const int steps : {5, 10, 20}) EXPECT_NEAR(std::log2(error(steps) / error(2 * steps)), 4.0, 0.2);
}

TEST(ReportMotor, CurrentBeyondTheAmplifiersLimitGivesNoMoreTorque) {
  const DcMotor motor = published::identified_motor();
  EXPECT_DOUBLE_EQ(motor.torque(1.0), 4.275e-2);
  EXPECT_DOUBLE_EQ(motor.torque(100.0), published::kMotorRatedTorque);
  EXPECT_DOUBLE_EQ(motor.torque(-100.0), -published::kMotorRatedTorque);
  const auto friction = block(motor);
  EXPECT_EQ(turn(motor, *friction, {}, motor.current_limit_a, 0.0, 100).velocity,
            turn(motor, *friction, {}, 50.0, 0.0, 100).velocity);
}

TEST(ReportMotor, TorquesBalanceAsInEquation25) {
  const DcMotor motor = published::identified_motor();
  for (const double velocity : {-80.0, -0.3, 0.3, 80.0})
    for (const double output : {-0.02, 0.0, 0.05}) {
      const double friction = motor.friction.torque(velocity);
      const double inertial = motor.inertia * motor.acceleration(1.2, output, friction);
      EXPECT_NEAR(motor.torque(1.2), inertial + friction + output, 1e-16);
    }
}

TEST(ReportMotor, FrictionHasTheFourFormsOfEquation27) {
  const double t_v = 0.01, t_s = 0.05, t_ss1 = 0.02, t_ss2 = 0.4;
  const FrictionCurve plain = FrictionCurve::symmetric({t_v, t_s, t_ss1, t_ss2});
  const FrictionCurve directional{{t_v, t_s}, {2.0 * t_v, 3.0 * t_s}};
  const FrictionCurve tustin = FrictionCurve::symmetric({t_v, t_s, t_ss1, t_ss2}, Stribeck::tustin);
  const FrictionCurve hess_soom = FrictionCurve::symmetric({t_v, t_s, t_ss1, t_ss2}, Stribeck::hess_soom);
  for (const double w : {1e-3, 0.1, 0.4, 2.0, 50.0}) {
    const double base = t_v * w + t_s;
    EXPECT_NEAR(plain.torque(w), base, 1e-15);
    EXPECT_NEAR(plain.torque(-w), -base, 1e-15);
    EXPECT_NEAR(directional.torque(w), base, 1e-15);
    EXPECT_NEAR(directional.torque(-w), -(2.0 * t_v * w + 3.0 * t_s), 1e-15);
    EXPECT_NEAR(tustin.torque(-w), -(base + t_ss1 * std::exp(-std::pow(w / t_ss2, 2))), 1e-15);
    EXPECT_NEAR(hess_soom.torque(-w), -(base + t_ss1 / (1.0 + std::pow(w / t_ss2, 2))), 1e-15);
  }
  // u(0) = 0 in eq. 28.
  EXPECT_EQ(directional.torque(0.0), 0.0);
}

TEST(ReportMotor, SettlesAtTheSpeedAtWhichFrictionTakesAllTorque) {
  const DcMotor motor = published::identified_motor();
  const auto friction = block(motor);
  const double forward = turn(motor, *friction, {}, 0.4, 0.0, 20'000).velocity;
  const double backward = turn(motor, *friction, {}, -0.4, 0.0, 20'000).velocity;
  EXPECT_NEAR(forward, (0.4 * 4.275e-2 - 1.1e-2) / 4.2e-5, 1e-4);
  EXPECT_NEAR(backward, -(0.4 * 4.275e-2 - 1.0e-2) / 4.2e-5, 1e-4);
  // Section 3.7: "the speeds the rotor reaches is more in negative direction than that in positive direction".
  EXPECT_GT(-backward, forward);
}

TEST(ReportMotor, CoulombFrictionStopsItAfterInertiaTimesSpeedOverTorque) {
  const double inertia = 1e-4, coulomb = 0.04, speed = 100.0;
  const DcMotor motor{0.1, 10.0, inertia, FrictionCurve::symmetric({0.0, coulomb, 0.0, 1.0})};
  const double stop = inertia * speed / coulomb;  // 0.25 s
  const auto implicit = block(motor, FrictionMethod::implicit);
  double velocity = speed;
  int steps = 0;
  for (; velocity != 0.0 && steps < 1000; ++steps) velocity = implicit->next_velocity(velocity, 0.0);
  EXPECT_EQ(velocity, 0.0);
  EXPECT_NEAR(steps * kStep, stop, 1.01 * kStep);

  // The boundary layer is entered on time and then left behind exponentially; the way is that of constant braking.
  const auto layer = block(motor);
  EXPECT_NEAR(turn(motor, *layer, {0.0, speed}, 0.0, 0.0, 249).velocity, coulomb / inertia * kStep, 1e-9);
  const Motion end = turn(motor, *layer, {0.0, speed}, 0.0, 0.0, 400);
  EXPECT_NEAR(end.velocity, 0.0, 1e-12);
  // Half a layer width for a step more or less.
  EXPECT_NEAR(end.angle, 0.5 * speed * stop, coulomb / inertia * kStep * kStep);
}

TEST(ReportMotor, CoulombAndViscousFrictionStopItAfterALogarithmicTime) {
  const double inertia = 1e-4, coulomb = 0.04, viscous = 1e-3, speed = 100.0;
  const DcMotor motor{0.1, 10.0, inertia, FrictionCurve::symmetric({viscous, coulomb, 0.0, 1.0})};
  const double stop = inertia / viscous * std::log1p(viscous * speed / coulomb);  // 0.125 s
  const double step = 1e-5;
  const auto implicit = block(motor, FrictionMethod::implicit, step);
  double velocity = speed;
  int steps = 0;
  for (; velocity != 0.0 && steps < 100'000; ++steps) velocity = implicit->next_velocity(velocity, 0.0);
  // First order: half a step per time constant of 0.1 s, and the step in which it stops.
  EXPECT_NEAR(steps * step, stop, 2.0 * step);
}

}  // namespace
}  // namespace flexspline::report_motor_test
