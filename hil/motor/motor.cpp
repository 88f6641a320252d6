#include "hil/motor/motor.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::motor {
namespace {

// The current of a flux L i/sqrt(1 + (i/most)^2). The flux never reaches L most; a step that would pass it is held.
double unsaturated(double flux, double inductance, double most) {
  const double i = flux / inductance;
  if (most == 0.0) return i;
  const double share = std::clamp(i / most, -0.999, 0.999);
  return i / std::sqrt(1.0 - share * share);
}

}  // namespace

Plane to_plane(const Triple& x) {
  return {(2.0 * x[0] - x[1] - x[2]) / 3.0, (x[1] - x[2]) / std::sqrt(3.0)};
}
Triple to_phases(const Plane& x) {
  const double rest = std::sqrt(0.75) * x.beta;
  return {x.alpha, rest - x.alpha / 2.0, -rest - x.alpha / 2.0};
}
Axes to_axes(const Plane& x, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * x.alpha + s * x.beta, c * x.beta - s * x.alpha};
}
Plane to_plane(const Axes& x, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * x.d - s * x.q, s * x.d + c * x.q};
}

Motor::Motor(const MotorParameters& parameters) : p_(parameters), temperature_c_(parameters.ambient_c) {
  stop(0.0);
}

// The fifth harmonic turns against the rotor, the seventh with it: in the rotor's axes both have the order six.
Axes Motor::magnet(double angle) const {
  if (p_.harmonic_5 == 0.0 && p_.harmonic_7 == 0.0) return {p_.flux_vs, 0.0};
  const double c = std::cos(6.0 * angle), s = std::sin(6.0 * angle);
  return {p_.flux_vs * (1.0 + (p_.harmonic_5 + p_.harmonic_7) * c), p_.flux_vs * (p_.harmonic_7 - p_.harmonic_5) * s};
}
Axes Motor::magnet_slope(double angle) const {
  const double c = std::cos(6.0 * angle), s = std::sin(6.0 * angle);
  return {-6.0 * p_.flux_vs * (p_.harmonic_5 + p_.harmonic_7) * s,
          6.0 * p_.flux_vs * (p_.harmonic_7 - p_.harmonic_5) * c};
}
Axes Motor::currents_of(const Axes& flux, double angle) const {
  const Axes m = magnet(angle);
  return {unsaturated(flux.d - m.d, p_.inductance_d_h, p_.saturation_d_a),
          unsaturated(flux.q - m.q, p_.inductance_q_h, p_.saturation_q_a)};
}
double Motor::resistance_ohm() const {
  return p_.resistance_ohm * (1.0 + 0.00393 * (temperature_c_ - 20.0));
}
double Motor::torque_nm(double angle) const {
  const Axes i = currents(angle), slope = magnet_slope(angle);
  const double turns = angle / p_.pole_pairs;
  return 1.5 * p_.pole_pairs * (flux_.d * i.q - flux_.q * i.d + slope.d * i.d + slope.q * i.q) -
         p_.cogging_nm * std::sin(p_.cogging_per_turn * turns);
}
Axes Motor::rates(const Axes& flux, const Plane& voltage, const Rotor& at) const {
  const Axes v = to_axes(voltage, at.angle), i = currents_of(flux, at.angle);
  const double r = resistance_ohm();
  return {v.d - r * i.d + at.speed * flux.q, v.q - r * i.q - at.speed * flux.d};
}
void Motor::step(const Plane& voltage, const Rotor& at, double dt) {
  const Axes first = rates(flux_, voltage, at);
  const Axes half = {flux_.d + first.d * dt / 2.0, flux_.q + first.q * dt / 2.0};
  const Axes middle = rates(half, voltage, {at.angle + at.speed * dt / 2.0, at.speed});
  flux_ = {flux_.d + middle.d * dt, flux_.q + middle.q * dt};
  const Axes i = currents(at.angle + at.speed * dt);
  const double heat = 1.5 * resistance_ohm() * (i.d * i.d + i.q * i.q);
  temperature_c_ += (heat - (temperature_c_ - p_.ambient_c) / p_.thermal_resistance_k_w) / p_.heat_capacity_j_k * dt;
}
void Motor::step_open(const Triple& voltages, std::size_t open_phase, const Rotor& at, double dt) {
  // The current at the end of the step is linear in the voltage, but for saturation, which the next step takes out.
  const double after = at.angle + at.speed * dt;
  const auto current_with = [&](double terminal_v) {
    Motor copy = *this;
    Triple v = voltages;
    v[open_phase] = terminal_v;
    copy.step(to_plane(v), at, dt);
    return to_phases(to_plane(copy.currents(after), after))[open_phase];
  };
  const double without = current_with(0.0), with = current_with(1.0);
  Triple v = voltages;
  v[open_phase] = -without / (with - without);
  step(to_plane(v), at, dt);
}
void Motor::stop(double angle) {
  flux_ = magnet(angle);
}

}  // namespace flexspline::motor
