#include "hil/motor/shaft.hpp"

#include <cmath>
#include <numbers>

namespace flexspline::motor {

void Shaft::step(double torque_nm, double dt) {
  if (p_.blocked) return;
  const double driven = speed_ + (torque_nm - p_.viscous_nms * speed_) * dt / p_.inertia_kg_m2;
  const double most = p_.coulomb_nm * dt / p_.inertia_kg_m2;  // that friction can take in the step
  const double before = speed_;
  speed_ = std::abs(driven) <= most ? 0.0 : driven - std::copysign(most, driven);
  angle_ += (before + speed_) / 2.0 * dt;
}
void Shaft::set_turns(double turns) {
  angle_ = 2.0 * std::numbers::pi * turns;
}
double Shaft::turns() const {
  return angle_ / (2.0 * std::numbers::pi);
}

std::uint32_t ShaftEncoder::read(double shaft_turns) {
  if (p_.stands) return 0;
  const double seen = slip_.encoder_turns(shaft_turns, p_.slip_every_turns, p_.slip_turns);
  const double turns = (p_.reversed ? -seen : seen) + p_.offset_turns;
  const double counts = std::floor((turns - std::floor(turns)) * p_.counts_per_turn);
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(counts * std::ldexp(1.0, 32) / p_.counts_per_turn));
}

}  // namespace flexspline::motor
