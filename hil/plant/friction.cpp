#include "hil/plant/friction.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexspline::plant {
namespace {

constexpr double kNegligibleExponent = 45.0;

void add_stribeck(const Stribeck& term, const FrictionPoint& at, double speed, FrictionTorque& sum) {
  const double ratio = speed / term.velocity;
  const double power = term.exponent == 2.0 ? ratio * ratio : std::pow(ratio, term.exponent);
  if (power > kNegligibleExponent) return;
  const double height = (at.direction > 0.0 ? term.positive : term.negative) * std::exp(-power);
  sum.torque += at.direction * height;
  // d|w|/dw equals the direction, whose square is 1.
  sum.by_velocity -= height * term.exponent * power / std::max(speed, 1e-9);
}

void add_hess_soom(const HessSoom& term, const FrictionPoint& at, double speed, FrictionTorque& sum) {
  const double ratio = speed / term.velocity;
  const double value = (at.direction > 0.0 ? term.positive : term.negative) / (1.0 + ratio * ratio);
  sum.torque += at.direction * value;
  sum.by_velocity -= value * 2.0 * ratio / (term.velocity * (1.0 + ratio * ratio));
}

void add_load_friction(const LoadFriction& term, const FrictionPoint& at, double gear_ratio, FrictionTorque& sum) {
  const double magnitude = std::abs(at.torque);
  const double ratio = magnitude / term.reference;
  const double power = term.exponent == 1.0 ? ratio : std::pow(ratio, term.exponent);
  const double value = term.coefficient * term.reference * power / gear_ratio;
  sum.torque += at.direction * value;
  const double slope = term.exponent * value / std::max(magnitude, 1e-9);
  sum.by_torque += at.direction * (at.torque >= 0.0 ? slope : -slope);
}

void add_load_stiction(const LoadStiction& term, const FrictionPoint& at, double speed, double gear_ratio,
                       FrictionTorque& sum) {
  const double ratio = speed / term.velocity;
  if (ratio * ratio > kNegligibleExponent) return;
  const double share = term.coefficient * std::exp(-ratio * ratio) / gear_ratio;
  const double height = share * std::abs(at.torque);
  sum.torque += at.direction * height;
  sum.by_torque += at.torque < 0.0 ? -at.direction * share : at.direction * share;
  sum.by_velocity -= 2.0 * ratio / term.velocity * height;
}

// With the deflection at z, the loss is a quadratic of its magnitude that ends at the share of this direction of power.
void add_loss(const DrivingLoss& term, const FrictionPoint& at, double z, double gear_ratio, FrictionTorque& sum) {
  const bool drives = at.torque * z > 0.0;
  const double most = drives ? term.driving : term.driven;
  const double mean = 0.5 * (term.driving + term.driven);
  const double size = std::abs(z), share = size * (mean + (most - mean) * size) / gear_ratio;
  const double load = std::abs(at.torque);
  sum.torque += std::copysign(load * share, z);
  sum.by_torque += drives ? share : -share;
  sum.by_angle += load * (mean + 2.0 * (most - mean) * size) / gear_ratio * (1.0 - at.direction * z) / term.presliding;
}

void add_ripple(const Ripple& term, double angle, FrictionTorque& sum) {
  const double c = std::cos(term.order * angle);
  const double d = std::sin(term.order * angle);
  sum.torque += term.cosine * c + term.sine * d;
  sum.by_angle += term.order * (term.sine * c - term.cosine * d);
}

void add_load_ripple(const Ripple& term, const FrictionPoint& at, FrictionTorque& sum) {
  const double c = std::cos(term.order * at.angle);
  const double d = std::sin(term.order * at.angle);
  sum.torque += at.torque * (term.cosine * c + term.sine * d);
  sum.by_torque += term.cosine * c + term.sine * d;
  sum.by_angle += at.torque * term.order * (term.sine * c - term.cosine * d);
}

// Only what resists: the sign of the wave changes with the direction of motion, its place does not.
void add_angle_friction(const Ripple& term, const FrictionPoint& at, FrictionTorque& sum) {
  const double amplitude = std::hypot(term.cosine, term.sine);
  const double phase = term.order * at.angle - std::atan2(term.sine, term.cosine);
  sum.torque += at.direction * amplitude * std::cos(phase);
  sum.by_angle -= at.direction * amplitude * term.order * std::sin(phase);
}

void add_triangle(const TriangleRipple& term, double angle, FrictionTorque& sum) {
  const double turns = (term.order * angle + term.phase) / (2.0 * std::numbers::pi) + 0.25;
  const double fraction = turns - std::floor(turns);
  const double slope = 4.0 * term.amplitude * term.order / (2.0 * std::numbers::pi);
  const bool rising = fraction < 0.5;
  sum.torque += term.amplitude * (rising ? 4.0 * fraction - 1.0 : 3.0 - 4.0 * fraction);
  sum.by_angle += rising ? slope : -slope;
}

void add_bump(const Bump& term, const FrictionPoint& at, double gear_ratio, FrictionTorque& sum) {
  const double per_motor = term.of_output ? 1.0 / gear_ratio : 1.0;
  double distance = at.angle * per_motor - term.angle;
  if (!term.of_output) distance = std::remainder(distance, 2.0 * std::numbers::pi);
  const double ratio = distance / term.width;
  const double value = term.height * std::exp(-ratio * ratio);
  sum.torque += at.direction * value;
  sum.by_angle -= at.direction * value * 2.0 * ratio / term.width * per_motor;
}

void add_onset(const Onset& term, const FrictionPoint& at, double speed, FrictionTorque& sum) {
  const double share = 1.0 / (1.0 + std::exp(-(speed - term.velocity) / term.width));
  sum.torque += at.direction * term.height * share;
  sum.by_velocity += term.height * share * (1.0 - share) / term.width;
}

}  // namespace

bool MotorFriction::is_plain() const {
  return !has_bristle() && !(loss.presliding > 0.0) && power_torque == 0.0 && hess_soom.empty() && stribeck.empty() &&
         load.empty() && load_stiction.empty() && ripple.empty() && load_ripple.empty() && angle_friction.empty() &&
         triangle_ripple.empty() && bumps.empty() && onsets.empty();
}

double MotorFriction::viscous_factor(double temperature_c) const {
  if (temperature_coefficient == 0.0) return 1.0;
  return std::exp(-temperature_coefficient * (temperature_c - temperature_reference));
}

double MotorFriction::coulomb_factor(double temperature_c) const {
  if (coulomb_temperature_coefficient == 0.0) return 1.0;
  return std::exp(-coulomb_temperature_coefficient * (temperature_c - temperature_reference));
}

double LuGre::limit(double w) const {
  const double ratio = w / velocity;
  return coulomb + (static_friction - coulomb) * std::exp(-ratio * ratio);
}

double MotorFriction::bristle(const FrictionPoint& at) const {
  if (lugre.stiffness > 0.0) {
    // For the mean g of a step the law is linear in z, and solved by travel.
    const double most = 0.5 * (lugre.limit(at.velocity) + lugre.limit(at.anchor_velocity)) / lugre.stiffness;
    const double limit = at.direction * most;
    return limit + (at.bristle - limit) * std::exp(-at.direction * (at.angle - at.anchor) / most);
  }
  if (dahl_presliding <= 0.0) return 0.0;
  const double limit = at.direction * dahl_presliding;
  return limit + (at.bristle - limit) * std::exp(-at.direction * (at.angle - at.anchor) / dahl_presliding);
}

double MotorFriction::loss_deflection(const FrictionPoint& at) const {
  if (!(loss.presliding > 0.0)) return 0.0;
  return at.direction + (at.loss - at.direction) * std::exp(-at.direction * (at.angle - at.anchor) / loss.presliding);
}

FrictionTorque MotorFriction::evaluate(const FrictionPoint& at, double viscous_now) const {
  const double s = at.direction;
  const double along = s * at.velocity;  // negative where a solver evaluates beyond an event
  const double speed = std::abs(at.velocity);
  FrictionTorque sum;
  sum.torque = viscous_now * at.velocity + viscous_asymmetry * along + coulomb_asymmetry;
  sum.by_velocity = viscous_now + viscous_asymmetry * s;
  sum.torque += quadratic * at.velocity * along;
  sum.by_velocity += 2.0 * quadratic * std::abs(along);
  if (lugre.stiffness > 0.0) {
    const double z = bristle(at);
    const double slack = 1.0 - s * lugre.stiffness * z / lugre.limit(at.velocity);
    sum.torque += dry_share * lugre.stiffness * z + lugre.damping * at.velocity * slack;
    sum.by_angle += dry_share * lugre.stiffness * slack;
    sum.by_velocity += lugre.damping * slack;
  } else if (dahl_torque > 0.0) {
    const double z = bristle(at);
    const double stiffness = dry_share * dahl_torque / dahl_presliding;
    sum.torque += stiffness * z;
    sum.by_angle += stiffness * (1.0 - s * z / dahl_presliding);
  } else {
    sum.torque += s * coulomb * dry_share;
  }
  for (const HessSoom& term : hess_soom) add_hess_soom(term, at, speed, sum);
  for (const Stribeck& term : stribeck) add_stribeck(term, at, speed, sum);
  if (power_torque != 0.0) {
    const double value = power_torque * std::pow(speed / power_reference, power_exponent);
    sum.torque += along >= 0.0 ? s * value : -s * value;
    sum.by_velocity += value * power_exponent / std::max(speed, 1e-9);
  }
  for (const LoadFriction& term : load) add_load_friction(term, at, gear_ratio, sum);
  for (const LoadStiction& term : load_stiction) add_load_stiction(term, at, speed, gear_ratio, sum);
  if (loss.presliding > 0.0) add_loss(loss, at, loss_deflection(at), gear_ratio, sum);
  for (const Ripple& term : ripple) add_ripple(term, at.angle, sum);
  for (const Ripple& term : load_ripple) add_load_ripple(term, at, sum);
  for (const Ripple& term : angle_friction) add_angle_friction(term, at, sum);
  for (const TriangleRipple& term : triangle_ripple) add_triangle(term, at.angle, sum);
  for (const Bump& term : bumps) add_bump(term, at, gear_ratio, sum);
  for (const Onset& term : onsets) add_onset(term, at, speed, sum);
  return sum;
}

}  // namespace flexspline::plant
