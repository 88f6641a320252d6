#include <array>
#include <cmath>
#include <random>

#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::catalogue {
namespace {

using effects::Variable;
using RealInputs = effects::Inputs<Real>;

void set(RealInputs& in, Variable variable, double x) {
  switch (variable) {
    case Variable::velocity:
      in.velocity = x;
      in.speed = std::abs(x);
      break;
    case Variable::speed:
      in.speed = x;
      in.velocity = in.direction * x;
      break;
    case Variable::acceleration:
      in.acceleration = x;
      break;
    case Variable::motor_angle:
      in.angle = x;
      break;
    case Variable::output_velocity:
      in.output_velocity = x;
      break;
    case Variable::output_acceleration:
      in.output_acceleration = x;
      break;
    case Variable::output_angle:
      in.output_angle = x;
      break;
    case Variable::torsion:
      in.torsion = x;
      break;
    case Variable::torsion_rate:
      in.torsion_rate = x;
      break;
    case Variable::torque:
      in.torque = x;
      in.torque_magnitude = std::abs(x);
      break;
    case Variable::torque_magnitude:
      in.torque_magnitude = x;
      in.torque = x;
      break;
    case Variable::current:
      in.current = x;
      break;
    case Variable::temperature:
      in.temperature = x;
      break;
  }
}

double usual_size(Variable variable) {
  switch (variable) {
    case Variable::velocity:
    case Variable::speed:
      return 100.0;
    case Variable::acceleration:
      return 1000.0;
    case Variable::motor_angle:
    case Variable::output_angle:
      return 6.0;
    case Variable::output_velocity:
      return 1.0;
    case Variable::output_acceleration:
      return 10.0;
    case Variable::torsion:
      return 5e-3;
    case Variable::torsion_rate:
      return 0.1;
    case Variable::torque:
    case Variable::torque_magnitude:
      return 30.0;
    case Variable::current:
      return 3.0;
    case Variable::temperature:
      return 50.0;
  }
  return 1.0;
}

void turn(RealInputs& in, double direction) {
  in.direction = in.output_direction = in.torsion_direction = direction;
}

}  // namespace

std::vector<double> torque_over(const Entry& entry, std::span<const double> parameters,
                                const DriveConstants<double>& drive, Variable variable, std::span<const double> x,
                                double direction) {
  std::vector<RealInputs> inputs(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    inputs[k].viscous_scale = inputs[k].coulomb_scale = 1.0;
    inputs[k].temperature = drive.reference_temperature;
    turn(inputs[k], direction);
    set(inputs[k], variable, variable == Variable::motor_angle ? x[k] / drive.turn_angle_scale : x[k]);
  }
  std::vector<double> torque(x.size(), 0.0);
  entry.real.torque(parameters.data(), drive, entry.info->balance, inputs, torque.data());
  return torque;
}

std::optional<SingleVariable> single_variable(const Entry& entry, std::span<const double> parameters,
                                              const DriveConstants<double>& drive, double scale) {
  constexpr int kTrials = 200;
  constexpr double kRounding = 1e-12;
  if (entry.has_state || !entry.adds_torque() || entry.info->phase != Phase::source) return std::nullopt;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto torque = [&](const RealInputs& in) {
    double sum = 0.0;
    entry.real.torque(parameters.data(), drive, entry.info->balance, {&in, 1}, &sum);
    return sum;
  };
  std::array<bool, std::size(effects::kVariables)> depends{};
  bool turns = false, odd = true;
  for (int trial = 0; trial < kTrials; ++trial) {
    RealInputs in;
    in.viscous_scale = in.coulomb_scale = 1.0;
    turn(in, unit(random) < 0.0 ? -1.0 : 1.0);
    // What is a magnitude of another comes with it.
    // Cubed, so that small values, where friction laws bend, are drawn as well.
    const auto draw = [&](Variable v) { set(in, v, scale * usual_size(v) * std::pow(unit(random), 3.0)); };
    for (const effects::VariableInfo& v : effects::kVariables)
      if (v.variable != Variable::speed && v.variable != Variable::torque_magnitude) draw(v.variable);
    const double before = torque(in);
    for (std::size_t v = 0; v < depends.size(); ++v) {
      const Variable variable = effects::kVariables[v].variable;
      if (variable == Variable::speed || variable == Variable::torque_magnitude) continue;
      const RealInputs kept = in;
      draw(variable);
      const double after = torque(in);
      depends[v] = depends[v] || std::abs(after - before) > kRounding * (std::abs(after) + std::abs(before));
      in = kept;
    }
    turn(in, -in.direction);
    const double turned = torque(in);
    const double size = kRounding * (std::abs(turned) + std::abs(before));
    turns = turns || std::abs(turned - before) > size;
    odd = odd && std::abs(turned + before) <= size;
  }
  SingleVariable single;
  int found = 0;
  for (std::size_t v = 0; v < depends.size(); ++v)
    if (depends[v]) {
      single.variable = effects::kVariables[v].variable;
      ++found;
    }
  if (found > 1 || (turns && !odd)) return std::nullopt;
  // Of the direction alone: any signal will do.
  if (found == 0 && !turns) return std::nullopt;
  single.times_direction = turns;
  return single;
}

}  // namespace flexspline::catalogue
