#pragma once

#include <algorithm>

#include "hil/thesis_models/friction_curve.hpp"

namespace flexspline::report {

/// The DC motor with its servo amplifier (figures 4 to 6).
struct DcMotor {
  double torque_constant = 0.0;  ///< K_m, N m/A
  double current_limit_a = 0.0;  ///< i_sat
  double inertia = 0.0;          ///< J_m, kg m^2
  FrictionCurve friction;

  /// Eq. 26: N m, bounded by the amplifier's current.
  double torque(double current_a) const {
    return torque_constant * std::clamp(current_a, -current_limit_a, current_limit_a);
  }
  /// The driving torque without friction: the `driving_nm` of a FrictionBlock. `output_nm` is the torque that the shaft
  /// delivers, tau_o.
  double driving_torque(double current_a, double output_nm) const { return torque(current_a) - output_nm; }
  /// Eq. 29, rad/s^2, with the amplifier's limit of eq. 26.
  double acceleration(double current_a, double output_nm, double friction_nm) const {
    return (driving_torque(current_a, output_nm) - friction_nm) / inertia;
  }
};

}  // namespace flexspline::report
