// What the effects of a shaft add up to where they are linear in its motion, which they are found to be by trying
// them.
#pragma once

#include <optional>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::simulation {

// Torque of effects on one shaft: acceleration a + velocity w + speed abs(w) + direction s + moving s^2 + constant.
struct PiecewiseLinear {
  double acceleration = 0.0;
  double velocity = 0.0;
  double speed = 0.0;
  double direction = 0.0;
  double moving = 0.0;
  double constant = 0.0;

  PiecewiseLinear& operator+=(const PiecewiseLinear& other);
  double torque(double a, double w, double s) const {
    const double size = w < 0.0 ? -w : w;
    return acceleration * a + velocity * w + speed * size + direction * s + moving * s * s + constant;
  }
  // A shaft that moves in direction s (not zero), with a = (w - base)/theta: what is left over at rest, and the
  // velocity at which nothing is.
  double left_at_rest(double s, double base, double theta, double driving) const {
    return direction * s + moving + constant - acceleration * base / theta - driving;
  }
  double velocity_in(double s, double base, double theta, double driving) const {
    return -left_at_rest(s, base, theta, driving) / (acceleration / theta + velocity + speed * s);
  }
};

// Nothing where the effect reads anything else, bends, or adds to another balance as well. Modulations are taken to be
// absent. `balance`: motor or load.
std::optional<PiecewiseLinear> piecewise_linear_of(const catalogue::Instance& instance, catalogue::Balance balance);
// The stiffness of an effect that is nothing but a linear spring on the transmission.
std::optional<double> spring_of(const catalogue::Instance& instance);

}  // namespace flexspline::simulation
