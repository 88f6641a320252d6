// Effects that reach more than one balance, or act through others: errors of the torque sensor, kinematic error, shifts
// before a spring, temperature before friction.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::tests::effects_balances_test {
namespace {

using catalogue::Instance;
using catalogue::Real;
using effects::DriveConstants;
using effects::Inputs;
using effects::Torques;
using Values = std::vector<double>;

constexpr double kGearRatio = 100.0;

DriveConstants<double> drive() {
  DriveConstants<double> constants;
  constants.gear_ratio = kGearRatio;
  constants.reference_temperature = 25.0;
  return constants;
}

std::unique_ptr<Instance> make(std::string_view effect, const Values& parameters) {
  return catalogue::get(effect).make(parameters.data(), drive());
}

Torques<Real> torques_of(std::string_view effect, const Values& parameters, const Inputs<Real>& in) {
  Torques<Real> out{};
  make(effect, parameters)->evaluate(in, out);
  return out;
}

// A drive whose torque is known: Km i = J a + T/N on the motor, T = K dq in the gear, T = Jo ao at the load. What the
// sensor reads stands in for T in all three balances; with the sensor's error as an effect each must still close.
struct TrueDrive {
  double torque, angle;

  double reading(double gain, double offset, const std::function<double(double)>& ripple) const {
    return (1.0 + gain) * torque + offset + ripple(angle);
  }
  void expect_closed(std::string_view effect, const Values& parameters, double reading) const {
    Inputs<Real> in;
    in.angle = angle;
    in.torque = reading;
    in.torque_magnitude = std::abs(reading);
    const Torques<Real> error = torques_of(effect, parameters, in);
    const double allowed = 1e-12 * (1.0 + std::abs(torque));
    // Transmission: reading = K dq + error.
    EXPECT_NEAR(error.transmission, reading - torque, allowed);
    // Motor: Km i = J a + reading/N + error.
    EXPECT_NEAR(error.motor, (torque - reading) / kGearRatio, allowed / kGearRatio);
    // Load: reading = Jo ao + error.
    EXPECT_NEAR(error.load, reading - torque, allowed);
  }
};

TEST(TorqueSensor, ErrorsLeaveTheTrueTorqueInAllThreeBalances) {
  const auto none = [](double) { return 0.0; };
  for (const double torque : {-40.0, -3.0, 0.0, 12.5}) {
    for (const double angle : {-2.0, 0.0, 0.4, 31.0}) {
      const TrueDrive truth{torque, angle};
      for (const double offset : {-0.3, 0.2})
        truth.expect_closed("torque_offset", {offset}, truth.reading(0.0, offset, none));
      for (const double gain : {-0.25, 0.03, 0.3})
        truth.expect_closed("torque_sensor_gain", {gain}, truth.reading(gain, 0.0, none));
      for (const double order : {1.0, 2.0, 4.0})
        truth.expect_closed("torque_sensor_ripple", {order, 0.3, -0.1}, truth.reading(0.0, 0.0, [&](double q) {
          return 0.3 * std::cos(order * q) - 0.1 * std::sin(order * q);
        }));
    }
  }
}

// With both, the reading is the gain times the sum of all that is modelled, the offset among it.
TEST(TorqueSensor, GainActsOnTheModelledTorqueWithTheOffsetInIt) {
  const double torque = 20.0, offset = 0.2, ratio = 0.05;
  Inputs<Real> in;
  in.torque = (1.0 + ratio) * (torque + offset);
  Torques<Real> sum{};
  make("torque_offset", {offset})->evaluate(in, sum);
  make("torque_sensor_gain", {ratio})->evaluate(in, sum);
  EXPECT_NEAR(in.torque - sum.transmission, torque, 1e-12);
  EXPECT_NEAR(in.torque - sum.load, torque, 1e-12);
  EXPECT_NEAR(in.torque / kGearRatio + sum.motor, torque / kGearRatio, 1e-14);
}

// Energy of a spring with a kinematic error: V = K/2 (q/N - qo + e(q))^2. What it takes to turn the motor is dV/dq, and
// what the output feels is -dV/dqo.
TEST(KinematicError, CostsTheMotorWhatVirtualWorkDemands) {
  const double stiffness = 6300.0;
  const Values error = {2.0, 4e-5, -3e-5};
  const auto e = [&](double q) { return error[1] * std::cos(error[0] * q) + error[2] * std::sin(error[0] * q); };
  const auto energy = [&](double q, double qo) {
    const double torsion = q / kGearRatio - qo + e(q);
    return 0.5 * stiffness * torsion * torsion;
  };
  for (const double q : {-3.0, 0.0, 0.7, 11.0}) {
    const double qo = q / kGearRatio - 1.5e-3;
    Inputs<Real> in;
    in.angle = q;
    in.torsion = q / kGearRatio - qo;
    make("kinematic_error", error)->shift(in);
    in.torque = torques_of("linear_stiffness", {stiffness}, in).transmission;
    const Torques<Real> extra = torques_of("kinematic_error", error, in);
    const double h = 1e-4;
    const double motor = (energy(q + h, qo) - energy(q - h, qo)) / (2.0 * h);
    const double output = -(energy(q, qo + 1e-6) - energy(q, qo - 1e-6)) / 2e-6;
    EXPECT_NEAR(in.torque, output, 1e-6 * std::abs(output));
    EXPECT_NEAR(in.torque / kGearRatio + extra.motor, motor, 1e-6 * std::abs(motor));
    EXPECT_GT(std::abs(extra.motor), 1e-5) << "of some 0.1 N m";
    EXPECT_EQ(extra.transmission, 0.0) << "there it acts through the torsion alone";
    EXPECT_EQ(extra.load, 0.0);
  }
}

TEST(KinematicError, ChangesTheRateOfTheTorsionAsItsAngleTurns) {
  const Values error = {2.0, 4e-5, -3e-5};
  const auto shifted = [&](double q, double velocity) {
    Inputs<Real> in;
    in.angle = q;
    in.velocity = velocity;
    in.torsion = 1e-3;
    in.torsion_rate = 0.02;
    make("kinematic_error", error)->shift(in);
    return in;
  };
  const double velocity = 150.0, h = 1e-5;
  for (const double q : {-1.0, 0.3, 2.0}) {
    const double rate = (shifted(q + h, 0.0).torsion - shifted(q - h, 0.0).torsion) / (2.0 * h) * velocity;
    EXPECT_NEAR(shifted(q, velocity).torsion_rate - 0.02, rate, 1e-8 * std::abs(rate) + 1e-10);
  }
}

// What a kinematic error looks like from the motor alone.
TEST(LoadScaledRipple, IsTheShadowOfAKinematicErrorOnTheMotor) {
  const double order = 2.0, cosine = 4e-5, sine = -3e-5;
  for (const double q : {-3.0, 0.1, 5.0})
    for (const double torque : {-30.0, 8.0}) {
      Inputs<Real> in;
      in.angle = q;
      in.torque = torque;
      const Torques<Real> error = torques_of("kinematic_error", {order, cosine, sine}, in);
      const Torques<Real> ripple = torques_of("load_scaled_ripple", {order, order * sine, -order * cosine}, in);
      EXPECT_NEAR(error.motor, ripple.motor, 1e-15);
      EXPECT_NE(error.motor, 0.0);
    }
}

TEST(TorsionZero, BesideALinearSpringIsATorqueOffsetThatTheSensorsErrorIsNot) {
  const double stiffness = 6300.0, zero = 1e-4;
  for (const double torsion : {-2e-3, 0.0, 1e-3}) {
    Inputs<Real> in;
    in.torsion = torsion;
    const double plain = torques_of("linear_stiffness", {stiffness}, in).transmission;
    make("torsion_zero", {zero})->shift(in);
    const double shifted = torques_of("linear_stiffness", {stiffness}, in).transmission;
    const Torques<Real> offset = torques_of("torque_offset", {stiffness * zero}, in);
    EXPECT_NEAR(shifted - plain, offset.transmission, 1e-12) << "alike on the transmission balance";
    EXPECT_NE(offset.motor, 0.0) << "a sensor's error shows on the motor balance as well";
  }
}

// Shifts act one after the other, and a dead zone is about the zero that those before it leave.
TEST(Backlash, OpensAboutTheZeroThatEarlierShiftsLeave) {
  const auto torque_at = [](double torsion, std::vector<std::string_view> order) {
    Inputs<Real> in;
    in.torsion = torsion;
    for (const std::string_view shift : order) make(shift, {shift == "backlash" ? 2e-4 : 1e-4})->shift(in);
    return torques_of("linear_stiffness", {1e4}, in).transmission;
  };
  EXPECT_EQ(torque_at(-1e-4, {"torsion_zero", "backlash"}), 0.0);
  EXPECT_EQ(torque_at(-3e-4, {"torsion_zero", "backlash"}), 0.0);
  EXPECT_NEAR(torque_at(3e-4, {"torsion_zero", "backlash"}), 2.0, 1e-12);
  EXPECT_NEAR(torque_at(-1e-4, {"backlash", "torsion_zero"}), 1.0, 1e-12) << "a gap that pushes";
}

TEST(PiecewiseStiffness, HasItsCornersAtTheStatedTorquesAndIsOdd) {
  const Values slopes = {4725.0, 6300.0, 7875.0, 3.0, 7.0};
  const auto torque_at = [&](double torsion) {
    Inputs<Real> in;
    in.torsion = torsion;
    return torques_of("piecewise_stiffness", slopes, in).transmission;
  };
  const double first = 3.0 / 4725.0, second = first + 4.0 / 6300.0;
  EXPECT_NEAR(torque_at(first), 3.0, 1e-12);
  EXPECT_NEAR(torque_at(second), 7.0, 1e-12);
  EXPECT_NEAR(torque_at(second + 1e-3), 7.0 + 7.875, 1e-12);
  for (const double x : {0.5 * first, 1.5 * first, 3.0 * second}) EXPECT_EQ(torque_at(-x), -torque_at(x));
}

TEST(TemperatureCoulomb, ScalesCoulombFrictionAndTheBristlesThatStandForIt) {
  const double b = 0.005;
  const auto term = [&](std::string_view effect, const Values& parameters, double temperature) {
    Inputs<Real> before, now;
    before.viscous_scale = before.coulomb_scale = now.viscous_scale = now.coulomb_scale = 1.0;
    now.angle = 0.03;
    now.velocity = now.speed = 1e-9;  // so slow that damping and viscous friction are zero
    now.direction = 1.0;
    now.temperature = temperature;
    make("temperature_coulomb", {b})->modulate(now);
    Torques<Real> out{};
    make(effect, parameters)->evaluate_ahead(now, before, out);
    return out.motor;
  };
  for (const double temperature : {-10.0, 25.0, 60.0}) {
    const double factor = std::exp(-b * (temperature - 25.0));
    for (const auto& [effect, parameters] : {std::pair<std::string_view, Values>{"coulomb_friction", {0.045}},
                                             {"dahl_friction", {0.045, 0.05}},
                                             {"lugre_friction", {0.045, 0.055, 3.0, 0.4, 1e-4}}}) {
      const double at_reference = term(effect, parameters, 25.0);
      EXPECT_GT(at_reference, 0.01) << effect;
      EXPECT_NEAR(term(effect, parameters, temperature), factor * at_reference, 1e-10 * at_reference) << effect;
    }
    Inputs<Real> in;
    in.viscous_scale = in.coulomb_scale = 1.0;
    in.temperature = temperature;
    make("temperature_coulomb", {b})->modulate(in);
    EXPECT_EQ(in.viscous_scale, 1.0) << "viscous friction has a coefficient of its own";
  }
}

// Both take the place of what the measured current says: the motor's true torque is Km times the current that it gets.
TEST(CurrentEffects, SayWhatIsMissingFromTheLoggedCurrent) {
  DriveConstants<double> constants;
  constants.torque_constant = 0.05;
  const auto motor = [&](std::string_view effect, double parameter, double current) {
    Inputs<Real> in;
    in.current = current;
    Torques<Real> out{};
    catalogue::get(effect).make(&parameter, constants)->evaluate(in, out);
    return out.motor;
  };
  for (const double current : {-5.0, -1.0, 0.0, 2.0, 4.0}) {
    const double clipped = std::max(-3.0, std::min(3.0, current));
    EXPECT_NEAR(0.05 * current - motor("current_saturation", 3.0, current), 0.05 * clipped, 1e-15);
    EXPECT_NEAR(0.05 * current - motor("torque_constant_error", 0.2, current), 1.2 * 0.05 * current, 1e-15);
    // Less torque per ampere at large currents, in both directions.
    const double saturated = 0.05 * current - motor("torque_constant_saturation", 5e-3, current);
    EXPECT_NEAR(saturated, 0.05 * current * (1.0 - 5e-3 * current * current), 1e-15);
    EXPECT_LE(std::abs(saturated), 0.05 * std::abs(current));
  }
}

}  // namespace
}  // namespace flexspline::tests::effects_balances_test
