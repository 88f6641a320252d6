#pragma once

namespace flexspline::report {

/// The third term of eq. 27, which fades with speed: Hess and Soom (eq. 52) or Tustin's exponential (eq. 53).
enum class Stribeck { none, hess_soom, tustin };

/// Friction in one direction; torques in N m are positive where they resist the motion.
struct DirectionalFriction {
  double viscous = 0.0;            ///< T_v, N m s/rad
  double coulomb = 0.0;            ///< T_s, N m
  double stribeck = 0.0;           ///< T_ss1, N m; negative as in table 8: less friction at break-away than in motion
  double stribeck_velocity = 1.0;  ///< T_ss2, rad/s
};

/// Friction as a function of velocity, eq. 27 and 44, with coefficients for each direction.
struct FrictionCurve {
  DirectionalFriction positive;
  DirectionalFriction negative;
  Stribeck shape = Stribeck::none;

  static FrictionCurve symmetric(const DirectionalFriction& both, Stribeck shape = Stribeck::none) {
    return {both, both, shape};
  }

  /// Torque (N m) that resists motion at `velocity_rad_s`, with its sign; zero at rest, as u(0) = 0 in eq. 28.
  double torque(double velocity_rad_s) const;
  /// The part that does not vanish with the speed: Coulomb and Stribeck, N m, for `direction` +1 or -1, at `speed` >=
  /// 0.
  double dry(double speed_rad_s, int direction) const;
  double viscous(int direction) const { return of(direction).viscous; }

 private:
  const DirectionalFriction& of(int direction) const { return direction < 0 ? negative : positive; }
};

}  // namespace flexspline::report
