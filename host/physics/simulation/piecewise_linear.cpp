#include "host/physics/simulation/piecewise_linear.hpp"

#include <cmath>
#include <random>

namespace flexspline::simulation {
namespace {

using catalogue::Balance;
using Inputs = effects::Inputs<numbers::Real>;
using Torques = effects::Torques<numbers::Real>;

constexpr int kTrials = 8;
constexpr double kRounding = 1e-12;

Torques torques(const catalogue::Instance& instance, const Inputs& in) {
  Torques sums;
  instance.evaluate(in, sums);
  return sums;
}

Inputs resting() {
  Inputs in;
  in.viscous_scale = in.coulomb_scale = 1.0;
  return in;
}

Inputs random_inputs(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Inputs in = resting();
  for (double* x : {&in.angle, &in.velocity, &in.acceleration, &in.output_angle, &in.output_velocity,
                    &in.output_acceleration, &in.torsion, &in.torsion_rate, &in.torque, &in.current, &in.temperature})
    *x = 10.0 * unit(random);
  const auto sign = [](double x) { return x < 0.0 ? -1.0 : 1.0; };
  in.speed = std::abs(in.velocity);
  in.direction = sign(in.velocity);
  in.output_direction = sign(in.output_velocity);
  in.torsion_direction = sign(in.torsion_rate);
  in.torque_magnitude = std::abs(in.torque);
  return in;
}

}  // namespace

PiecewiseLinear& PiecewiseLinear::operator+=(const PiecewiseLinear& other) {
  acceleration += other.acceleration;
  velocity += other.velocity;
  speed += other.speed;
  direction += other.direction;
  moving += other.moving;
  constant += other.constant;
  return *this;
}

std::optional<PiecewiseLinear> piecewise_linear_of(const catalogue::Instance& instance, Balance balance) {
  const bool motor = balance == Balance::motor;
  const auto own = [&](const Torques& t) { return motor ? t.motor : t.load; };
  const auto at = [&](double Inputs::*signal, double x) {
    Inputs in = resting();
    in.*signal = x;
    return own(torques(instance, in));
  };
  PiecewiseLinear s;
  s.constant = own(torques(instance, resting()));
  s.acceleration = at(motor ? &Inputs::acceleration : &Inputs::output_acceleration, 1.0) - s.constant;
  s.velocity = at(motor ? &Inputs::velocity : &Inputs::output_velocity, 1.0) - s.constant;
  if (motor) s.speed = at(&Inputs::speed, 1.0) - s.constant;
  const auto direction = motor ? &Inputs::direction : &Inputs::output_direction;
  s.direction = 0.5 * (at(direction, 1.0) - at(direction, -1.0));
  s.moving = 0.5 * (at(direction, 1.0) + at(direction, -1.0)) - s.constant;
  std::mt19937 random(1);
  for (int i = 0; i < kTrials; ++i) {
    const Inputs in = random_inputs(random);
    const Torques t = torques(instance, in);
    const double expected = motor ? s.torque(in.acceleration, in.velocity, in.direction)
                                  : s.torque(in.output_acceleration, in.output_velocity, in.output_direction);
    const bool elsewhere = t.transmission != 0.0 || (motor ? t.load : t.motor) != 0.0;
    if (elsewhere || std::abs(own(t) - expected) > kRounding * (std::abs(expected) + std::abs(s.constant)))
      return std::nullopt;
  }
  return s;
}

std::optional<double> spring_of(const catalogue::Instance& instance) {
  Inputs twisted = resting();
  twisted.torsion = 1.0;
  const double stiffness = torques(instance, twisted).transmission;
  std::mt19937 random(1);
  for (int i = 0; i < kTrials; ++i) {
    const Inputs in = random_inputs(random);
    const Torques t = torques(instance, in);
    if (t.motor != 0.0 || t.load != 0.0 ||
        std::abs(t.transmission - stiffness * in.torsion) > kRounding * std::abs(t.transmission))
      return std::nullopt;
  }
  return stiffness;
}

}  // namespace flexspline::simulation
