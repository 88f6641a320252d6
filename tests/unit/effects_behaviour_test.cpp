// What single effects are known for, beyond the term of their equation: closed forms, dead zones, memory.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::tests::effects_behaviour_test {
namespace {

using catalogue::Balance;
using catalogue::Entry;
using catalogue::Real;
using effects::DriveConstants;
using effects::Inputs;
using Values = std::vector<double>;

const DriveConstants<double> kDrive;

std::vector<Inputs<Real>> along_path(const Values& path) {
  std::vector<Inputs<Real>> inputs;
  for (const double angle : path) {
    Inputs<Real> in;
    in.angle = angle;
    in.viscous_scale = in.coulomb_scale = 1.0;
    inputs.push_back(in);
  }
  return inputs;
}

Values dahl_torque(const Values& path, double torque_nm, double presliding_rad) {
  const double parameters[] = {torque_nm, presliding_rad};
  Values torque(path.size(), 0.0);
  catalogue::get("dahl_friction").real.torque(parameters, kDrive, Balance::motor, along_path(path), torque.data());
  return torque;
}

TEST(DahlFriction, DrawsTheClosedLoopOfStressAndStrain) {
  const double torque_nm = 0.05;
  const double presliding_rad = 0.02;
  Values path;
  for (int k = 0; k <= 100; ++k) path.push_back(0.01 * k);          // 50 presliding lengths: saturated
  for (int k = 1; k <= 300; ++k) path.push_back(1.0 - 0.0007 * k);  // back
  const Values torque = dahl_torque(path, torque_nm, presliding_rad);
  for (int k = 0; k <= 100; ++k)
    ASSERT_NEAR(torque[static_cast<std::size_t>(k)],
                torque_nm * (1.0 - std::exp(-path[static_cast<std::size_t>(k)] / presliding_rad)), 1e-14);
  for (std::size_t k = 101; k < path.size(); ++k) {
    const double back = 1.0 - path[k];
    ASSERT_NEAR(torque[k], torque_nm * (2.0 * std::exp(-back / presliding_rad) - 1.0), 1e-14);
  }
  EXPECT_NEAR(torque.back(), -torque_nm, 1e-4 * torque_nm);
  // The slope right after the reversal is twice sigma = Ts / presliding, as on every fully loaded Dahl loop.
  EXPECT_NEAR((torque[100] - torque[101]) / 0.0007, 2.0 * torque_nm / presliding_rad,
              0.02 * 2.0 * torque_nm / presliding_rad);
}

TEST(DahlFriction, DependsOnThePathAndNotOnItsSamplingOrRate) {
  const Values corners = {0.0, 0.03, -0.01, 0.5, 0.48, 0.49, -2.0, -1.99};
  const auto sampled = [&](int steps) {
    Values path = {corners.front()};
    for (std::size_t c = 1; c < corners.size(); ++c)
      for (int k = 1; k <= steps; ++k) path.push_back(corners[c - 1] + (corners[c] - corners[c - 1]) * k / steps);
    return path;
  };
  const double reference = dahl_torque(sampled(1), 0.045, 0.05).back();
  EXPECT_GT(std::abs(reference), 0.01);
  for (const int steps : {2, 7, 1000}) EXPECT_NEAR(dahl_torque(sampled(steps), 0.045, 0.05).back(), reference, 1e-13);
  // Standing still in between changes nothing, to the bit.
  Values waiting;
  for (const double q : corners) waiting.insert(waiting.end(), 5, q);
  EXPECT_EQ(dahl_torque(waiting, 0.045, 0.05).back(), reference);
}

TEST(DahlFriction, StaysWithinItsTorqueForAnyStep) {
  std::mt19937 random(7);
  std::normal_distribution<double> step(0.0, 1.0);
  Values path = {0.0};
  for (int k = 0; k < 2000; ++k) path.push_back(path.back() + std::pow(10.0, 2.0 * step(random)) * step(random));
  for (const double torque : dahl_torque(path, 0.045, 0.05)) ASSERT_LE(std::abs(torque), 0.045);
}

TEST(DahlFriction, InstanceLooksAheadWithoutMoving) {
  const double parameters[] = {0.045, 0.05};
  const auto instance = catalogue::get("dahl_friction").make(parameters, kDrive);
  const std::vector<Inputs<Real>> path = along_path({0.0, 0.02, 0.05});
  const auto motor_torque = [&](auto&& evaluate) {
    effects::Torques<Real> out{};
    evaluate(out);
    EXPECT_EQ(out.transmission, 0.0);
    EXPECT_EQ(out.load, 0.0);
    return out.motor;
  };
  for (std::size_t k = 1; k < path.size(); ++k) {
    const auto here = [&](auto& out) { instance->evaluate(path[k], out); };
    const double stands = motor_torque(here);
    const double ahead = motor_torque([&](auto& out) { instance->evaluate_ahead(path[k], path[k - 1], out); });
    EXPECT_EQ(motor_torque(here), stands);
    instance->advance(path[k], path[k - 1]);
    EXPECT_EQ(motor_torque(here), ahead);
    EXPECT_NE(ahead, stands);
  }
  EXPECT_NEAR(motor_torque([&](auto& out) { instance->evaluate(path.back(), out); }), 0.045 * (1.0 - std::exp(-1.0)),
              1e-15);
}

TEST(Backlash, LeavesASpringWithoutTorqueInItsDeadZoneAndContinuousAtItsEdge) {
  const double half_width[] = {2e-4};
  const double stiffness[] = {6.3e3};
  const auto gap = catalogue::get("backlash").make(half_width, kDrive);
  const auto spring = catalogue::get("linear_stiffness").make(stiffness, kDrive);
  const auto torque_at = [&](double torsion) {
    Inputs<Real> in;
    in.torsion = torsion;
    gap->shift(in);
    effects::Torques<Real> out{};
    spring->evaluate(in, out);
    return out.transmission;
  };
  for (const double inside : {-2e-4, -1e-4, 0.0, 1.9e-4, 2e-4}) EXPECT_EQ(torque_at(inside), 0.0);
  EXPECT_NEAR(torque_at(2e-4 + 1e-9), 6.3e-6, 1e-12);
  EXPECT_NEAR(torque_at(1e-3), 6.3e3 * 8e-4, 1e-12);
  EXPECT_NEAR(torque_at(-1e-3), -6.3e3 * 8e-4, 1e-12);
}

TEST(TemperatureViscous, TogetherWithViscousFrictionGivesTheTermOfTheCatalogue) {
  const Entry& warm = catalogue::get("temperature_viscous");
  const Entry& viscous = catalogue::get("viscous_friction");
  EXPECT_EQ(warm.info->modulates, viscous.name());
  const double b = 0.012;
  const double tv = 3.6e-4;
  const double reference_c = 25.0;
  DriveConstants<double> drive;
  drive.reference_temperature = reference_c;
  for (const double velocity : {-200.0, -3.0, 0.0, 120.0}) {
    for (const double temperature : {-10.0, 25.0, 70.0}) {
      Inputs<Real> in;
      in.velocity = velocity;
      in.temperature = temperature;
      in.viscous_scale = 1.0;
      const auto friction = viscous.make(&tv, drive);
      effects::Torques<Real> cold{};
      effects::Torques<Real> both{};
      friction->evaluate(in, cold);
      warm.make(&b, drive)->modulate(in);
      friction->evaluate(in, both);
      const double term = tv * (std::exp(-b * (temperature - reference_c)) - 1.0) * velocity;
      EXPECT_NEAR(both.motor - cold.motor, term, 1e-15);
      EXPECT_NEAR(cold.motor, tv * velocity, 1e-15);
    }
  }
}

TEST(TorqueRipple, CountsItsOrderPerPitchOnALinearAxis) {
  DriveConstants<double> drive;
  const double pitch_m = 5e-3;
  drive.turn_angle_scale = 2.0 * std::numbers::pi / pitch_m;
  const double parameters[] = {2.0, 3.0, 4.0};  // twice a turn; N
  Values force(4, 0.0);
  const std::vector<Inputs<Real>> inputs = along_path({0.0, pitch_m / 2.0, pitch_m / 4.0, pitch_m / 8.0});
  catalogue::get("torque_ripple").real.torque(parameters, drive, Balance::motor, inputs, force.data());
  EXPECT_NEAR(force[0], 3.0, 1e-12);
  EXPECT_NEAR(force[1], 3.0, 1e-12);
  EXPECT_NEAR(force[2], -3.0, 1e-12);
  EXPECT_NEAR(force[3], 4.0, 1e-12);
}

TEST(EffectsInDirection, AcceptASmoothSignBetweenMinusOneAndOne) {
  const auto torque = [](std::string_view name, Values parameters, double direction) {
    Inputs<Real> in;
    in.direction = direction;
    in.velocity = direction;  // slow
    in.viscous_scale = in.coulomb_scale = 1.0;
    effects::Torques<Real> out{};
    catalogue::get(name).make(parameters.data(), kDrive)->evaluate(in, out);
    return out.motor;
  };
  EXPECT_DOUBLE_EQ(torque("coulomb_friction", {0.04}, 0.5), 0.02);
  EXPECT_DOUBLE_EQ(torque("coulomb_asymmetry", {0.004}, -0.5), 0.001);
  EXPECT_DOUBLE_EQ(torque("coulomb_asymmetry", {0.004}, -1.0), 0.004);
  // Equal amplitudes are one Stribeck term that is odd in velocity, also where the sign is smooth.
  EXPECT_NEAR(torque("stribeck_gaussian", {0.01, 0.01, 3.0}, 0.5), 0.5 * 0.01 * std::exp(-0.25 / 9.0), 1e-15);
  EXPECT_NEAR(torque("stribeck_gaussian", {0.01, 0.01, 3.0}, -0.5), -0.5 * 0.01 * std::exp(-0.25 / 9.0), 1e-15);
}

}  // namespace
}  // namespace flexspline::tests::effects_behaviour_test
