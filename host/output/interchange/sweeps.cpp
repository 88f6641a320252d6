#include "host/output/interchange/sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/physics/simulation/balances.hpp"

namespace flexspline::interchange {
namespace {

using simulation::Balances;
using RealInputs = simulation::Inputs;
using RealTorques = simulation::Torques;

double sign_of(double x) {
  return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}

RealInputs at_rest(const catalogue::DriveConstants<double>& constants) {
  RealInputs in;
  in.temperature = constants.reference_temperature;
  in.viscous_scale = in.coulomb_scale = 1.0;
  return in;
}

// Twists step by step, each step a fixed part of the torsion so far.
class Twister {
 public:
  Twister(const model::Model& model, const catalogue::DriveConstants<double>& constants)
      : balances_(model, constants), before_(at_rest(constants)), constants_(constants) {
    balances_.change(before_);
  }
  double to(double torsion) {
    RealInputs now = at_rest(constants_);
    now.torsion = torsion;
    now.output_angle = -torsion;
    now.torsion_direction = sign_of(torsion - torsion_);
    now.output_direction = -now.torsion_direction;
    now.torque = torque_;
    now.torque_magnitude = std::abs(torque_);
    balances_.change(now);
    RealTorques sums;
    balances_.add_transmission(now, before_, sums);
    balances_.advance(now, before_);
    before_ = now;
    torsion_ = torsion;
    return torque_ = sums.transmission;
  }
  double torsion() const { return torsion_; }
  double torque() const { return torque_; }

 private:
  Balances balances_;
  RealInputs before_;
  const catalogue::DriveConstants<double>& constants_;
  double torsion_ = 0.0;
  double torque_ = 0.0;
};

constexpr double kFirst = 1e-7;  // rad
constexpr double kGrowth = 1.02;
constexpr double kFarthest = 1.0;

}  // namespace

SteadyTorque Sweeps::at_speed(double velocity) const {
  Balances balances(model_, constants_);
  constexpr int kSteps = 128;
  const double step = 2.0 * std::numbers::pi / constants_.turn_angle_scale / kSteps * sign_of(velocity);
  RealInputs now = at_rest(constants_);
  now.velocity = velocity;
  now.speed = std::abs(velocity);
  now.output_velocity = velocity / constants_.gear_ratio;
  now.direction = now.output_direction = sign_of(velocity);
  now.elapsed = velocity == 0.0 ? 0.0 : step / velocity;
  const RealInputs plain = now;
  balances.change(now);
  SteadyTorque mean;
  RealInputs before = now;
  // Presliding is over within a turn; the mean is over the second one.
  for (int k = 1; k <= 2 * kSteps; ++k) {
    now = plain;
    now.angle = k * step;
    now.output_angle = now.angle / constants_.gear_ratio;
    balances.change(now);
    RealTorques sums;
    balances.add_motor(now, before, sums);
    balances.add_load(now, before, sums);
    balances.advance(now, before);
    before = now;
    if (k <= kSteps) continue;
    mean.motor += sums.motor / kSteps;
    mean.load += sums.load / kSteps;
  }
  return mean;
}

double Sweeps::motor_inertia() const {
  return Balances(model_, constants_).motor_inertia();
}
double Sweeps::output_inertia() const {
  return Balances(model_, constants_).output_inertia();
}
bool Sweeps::has_transmission() const {
  return Balances(model_, constants_).has_transmission();
}

double Sweeps::torsion_at(double torque) const {
  Twister twister(model_, constants_);
  Twist before;
  for (double x = kFirst; x < kFarthest; x *= kGrowth) {
    const double t = twister.to(x);
    if (t >= torque) {
      const double share = t > before.torque ? (torque - before.torque) / (t - before.torque) : 0.0;
      return before.torsion + share * (x - before.torsion);
    }
    before = {x, t};
  }
  return 0.0;
}

std::vector<Twist> Sweeps::loop(double torque) const {
  const double most = torsion_at(torque);
  if (most <= 0.0) return {};
  Twister twister(model_, constants_);
  std::vector<Twist> all;
  constexpr int kBranch = 100;
  const auto branch = [&](double from, double to, int steps) {
    for (int k = 1; k <= steps; ++k) {
      const double x = from + (to - from) * k / steps;
      const double t = twister.to(x);
      all.push_back({x, t});
    }
  };
  branch(0.0, most, kBranch / 2);
  branch(most, -most, kBranch);
  branch(-most, most, kBranch);
  return all;
}

double Sweeps::torque_at_rate(double rate) const {
  const Balances balances(model_, constants_);
  RealInputs still = at_rest(constants_);
  RealInputs twisting = still;
  twisting.torsion_rate = rate;
  twisting.torsion_direction = sign_of(rate);
  RealTorques with, without;
  balances.add_transmission(twisting, twisting, with);
  balances.add_transmission(still, still, without);
  return with.transmission - without.transmission;
}

}  // namespace flexspline::interchange
