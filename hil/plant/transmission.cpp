#include "hil/plant/transmission.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::plant {
namespace {

TorqueSlope three_slopes(const ThreeSlopes& p, double torsion) {
  const double size = std::abs(torsion);
  const double first = p.torque_1 / p.stiffness_1;
  const double second = first + (p.torque_2 - p.torque_1) / p.stiffness_2;
  if (size <= first) return {p.stiffness_1 * torsion, p.stiffness_1};
  const bool middle = size <= second;
  const double torque =
      middle ? p.torque_1 + p.stiffness_2 * (size - first) : p.torque_2 + p.stiffness_3 * (size - second);
  return {std::copysign(torque, torsion), middle ? p.stiffness_2 : p.stiffness_3};
}

}  // namespace

double Transmission::error(double q) const {
  double sum = 0.0;
  for (const Ripple& e : kinematic_error) sum += e.cosine * std::cos(e.order * q) + e.sine * std::sin(e.order * q);
  return sum;
}

double Transmission::error_slope(double q) const {
  double sum = 0.0;
  for (const Ripple& e : kinematic_error)
    sum += e.order * (e.sine * std::cos(e.order * q) - e.cosine * std::sin(e.order * q));
  return sum;
}

TorqueSlope Transmission::spring(double torsion) const {
  const double gap = backlash_half_width;
  double deflection = torsion;
  double open = 1.0;
  if (gap > 0.0) {
    deflection = torsion > gap ? torsion - gap : (torsion < -gap ? torsion + gap : 0.0);
    if (deflection == 0.0) open = 0.0;
  }
  TorqueSlope sum = polynomial(deflection);
  if (slopes.stiffness_1 > 0.0) {
    const TorqueSlope more = three_slopes(slopes, deflection);
    sum.torque += more.torque;
    sum.slope += more.slope;
  }
  sum.slope *= open;
  return sum;
}

double Transmission::energy(double torsion) const {
  const double x = std::copysign(std::max(std::abs(torsion) - backlash_half_width, 0.0), torsion);
  double sum = x * x * (0.5 * stiffness + x * (quadratic_stiffness / 3.0 + 0.25 * cubic_stiffness * x));
  if (slopes.stiffness_1 > 0.0) {
    const double size = std::abs(x);
    const double first = slopes.torque_1 / slopes.stiffness_1;
    const double second = first + (slopes.torque_2 - slopes.torque_1) / slopes.stiffness_2;
    const double a = std::min(size, first), b = std::clamp(size, first, second) - first;
    const double c = std::max(size, second) - second;
    sum += 0.5 * slopes.stiffness_1 * a * a + b * (slopes.torque_1 + 0.5 * slopes.stiffness_2 * b) +
           c * (slopes.torque_2 + 0.5 * slopes.stiffness_3 * c);
  }
  return sum;
}

}  // namespace flexspline::plant
