#pragma once

#include <vector>

#include "hil/plant/friction.hpp"
#include "hil/plant/hysteresis.hpp"

namespace flexspline::plant {

/// Three slopes with corners at these torques, odd.
struct ThreeSlopes {
  double stiffness_1 = 0.0;  ///< zero: the drive has none
  double stiffness_2 = 0.0;
  double stiffness_3 = 0.0;
  double torque_1 = 0.0;
  double torque_2 = 0.0;
};

/// Spring and loops of the flexspline; its damping by rate is the integrator's.
struct Transmission {
  double stiffness = 0.0;
  double quadratic_stiffness = 0.0;
  double cubic_stiffness = 0.0;
  double backlash_half_width = 0.0;
  ThreeSlopes slopes;
  Loops loops;
  /// The gear's error e(q) = cosine cos(k q) + sine sin(k q), rad at the output: the spring is twisted by dq + e(q).
  std::vector<Ripple> kinematic_error;

  bool has_spring() const { return stiffness > 0.0 || slopes.stiffness_1 > 0.0 || !loops.duhem.empty(); }
  double error(double motor_angle) const;
  /// de/dq: the error's addition to one over the gear ratio, for velocities and, by virtual work, for torques.
  double error_slope(double motor_angle) const;
  /// Of the spring only, without loops.
  TorqueSlope spring(double torsion) const;
  /// Without backlash, corners and gear error: spring() is polynomial().
  bool is_polynomial() const {
    return !(backlash_half_width > 0.0) && !(slopes.stiffness_1 > 0.0) && kinematic_error.empty();
  }
  TorqueSlope polynomial(double deflection) const {
    return {deflection * (stiffness + deflection * (quadratic_stiffness + cubic_stiffness * deflection)),
            stiffness + deflection * (2.0 * quadratic_stiffness + 3.0 * cubic_stiffness * deflection)};
  }
  /// Energy of the spring, J; backlash and three slopes included.
  double energy(double torsion) const;
};

}  // namespace flexspline::plant
