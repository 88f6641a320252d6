#include "hil/plant/hysteresis.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::plant {
namespace {

double sign_of(double x) {
  return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0);
}

double bound_of(const DahlLoop& law, double total_torque) {
  return law.torque + law.torque_share * std::abs(total_torque);
}

// du/dx = -(sigma/B) u^i for the distance u to the limit, as a share of it.
double dahl_after(const DahlLoop& law, double bound, double torque, double travel) {
  const double s = sign_of(travel);
  const double before = 1.0 - s * torque / bound;
  const double size = std::abs(before);
  const double x = law.stiffness * std::abs(travel) / bound;
  double after = 0.0;
  if (law.exponent == 1.0) {
    after = size * std::exp(-x);
  } else if (size > 0.0) {
    const double p = 1.0 - law.exponent;
    const double left = std::pow(size, p) - p * x;
    after = left > 0.0 ? std::pow(left, 1.0 / p) : 0.0;
  }
  return s * bound * (1.0 - std::copysign(after, before));
}

double dahl_slope(const DahlLoop& law, double bound, double torque, double s) {
  const double left = 1.0 - s * torque / bound;
  return law.stiffness * std::pow(std::abs(left), law.exponent) * sign_of(left);
}

double duhem_slope(const DuhemLoop& law, double torque, double x, double s) {
  const double phi = law.phi[0] + x * (law.phi[1] + x * (law.phi[2] + x * law.phi[3]));
  return s * law.rate * (phi - torque) + law.stiffness;
}

double bouc_wen_slope(const BoucWenLoop& law, double z, double s) {
  const double power = std::pow(std::abs(z), law.exponent);
  return 1.0 - s * law.beta * power * sign_of(z) - law.gamma * power;
}

template <class Slope>
double runge_kutta(double y, double from, double to, double length, Slope slope) {
  if (from == to) return y;
  const int steps = 1 + static_cast<int>(50.0 * std::abs(to - from) / length);
  const double h = (to - from) / steps;
  for (int i = 0; i < steps; ++i) {
    const double x = from + i * h;
    const double k1 = slope(y, x);
    const double k2 = slope(y + 0.5 * h * k1, x + 0.5 * h);
    const double k3 = slope(y + 0.5 * h * k2, x + 0.5 * h);
    const double k4 = slope(y + h * k3, x + h);
    y += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return y;
}

}  // namespace

LoopState Loops::ahead(const LoopState& from, double torsion, bool kept) const {
  LoopState to = from;
  const double travel = torsion - from.torsion;
  const double s = sign_of(travel);
  if (s == 0.0) return to;
  to.torsion = torsion;
  std::size_t at = 0;
  for (const DahlLoop& law : dahl) {
    to.inner[at] = dahl_after(law, bound_of(law, from.total_torque), from.inner[at], travel);
    ++at;
  }
  for (const DuhemLoop& law : duhem) {
    to.inner[at] = runge_kutta(from.inner[at], from.torsion, torsion, 1.0 / law.rate,
                               [&](double y, double x) { return duhem_slope(law, y, x, s); });
    ++at;
  }
  for (const BoucWenLoop& law : bouc_wen) {
    const double length = std::pow(law.beta + std::abs(law.gamma), -1.0 / law.exponent);
    to.inner[at] = runge_kutta(from.inner[at], from.torsion, torsion, length,
                               [&](double z, double) { return bouc_wen_slope(law, z, s); });
    ++at;
  }
  for (std::size_t j = 0; j < plays.size(); ++j)
    to.play[j] = std::clamp(from.play[j], torsion - plays[j].threshold, torsion + plays[j].threshold);
  for (std::size_t j = 0; kept && j < relays.size(); ++j)
    to.relay[j] = torsion >= relays[j].high ? 1 : (torsion <= relays[j].low ? -1 : from.relay[j]);
  return to;
}

TorqueSlope Loops::torque(const LoopState& state, double sign) const {
  TorqueSlope sum;
  std::size_t at = 0;
  for (const DahlLoop& law : dahl) {
    const double torque = state.inner[at++];
    sum.torque += torque;
    sum.slope += dahl_slope(law, bound_of(law, state.total_torque), torque, sign);
  }
  for (const DuhemLoop& law : duhem) {
    const double torque = state.inner[at++];
    sum.torque += torque;
    sum.slope += duhem_slope(law, torque, state.torsion, sign);
  }
  for (const BoucWenLoop& law : bouc_wen) {
    const double z = state.inner[at++];
    sum.torque += law.stiffness * z;
    sum.slope += law.stiffness * bouc_wen_slope(law, z, sign);
  }
  for (std::size_t j = 0; j < plays.size(); ++j) {
    sum.torque += plays[j].weight * state.play[j];
    if (sign * (state.torsion - state.play[j]) >= plays[j].threshold * (1.0 - 1e-12)) sum.slope += plays[j].weight;
  }
  for (std::size_t j = 0; j < relays.size(); ++j) sum.torque += relays[j].weight * state.relay[j];
  return sum;
}

LoopState Loops::at_rest() const {
  LoopState state;
  for (std::size_t j = 0; j < relays.size(); ++j) state.relay[j] = relays[j].high + relays[j].low > 0.0 ? -1 : 1;
  return state;
}

std::vector<double> torque_along(const Loops& loops, double stiffness, double cubic_stiffness,
                                 const std::vector<double>& torsion) {
  LoopState state = loops.at_rest();
  std::vector<double> torque;
  torque.reserve(torsion.size());
  for (const double x : torsion) {
    state = loops.ahead(state, x, true);
    torque.push_back(x * (stiffness + cubic_stiffness * x * x) + loops.torque(state, 1.0).torque);
    state.total_torque = torque.back();
  }
  return torque;
}

}  // namespace flexspline::plant
