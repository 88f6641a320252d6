// Models 1 to 3 of the harmonic drive (report, section 2.2). The output is positive against the input's direction,
// which avoids a minus sign (as in the report). Inputs are the wave generator's motion and the flexspline's torque or
// motion.
#pragma once

#include "hil/thesis_models/friction_curve.hpp"

namespace flexspline::report {

/// Model 1: an ideal gear, eq. 33 to 35.
struct IdealDrive {
  double gear_ratio = 100.0;

  double output_angle(double input_angle) const { return input_angle / gear_ratio; }
  double output_velocity(double input_velocity) const { return input_velocity / gear_ratio; }
  double input_torque(double output_torque) const { return output_torque / gear_ratio; }
};

/// Torsion and torque of the flexspline, T = K1 x + K2 x^3 (eq. 37; the K2 of eq. 37 is the K3 of eq. 69 to 77).
class CubicSpring {
 public:
  /// N m/rad and N m/rad^3. Throws std::invalid_argument unless K1 is positive and K2 finite.
  CubicSpring(double k1, double k2);

  double torque(double torsion_rad) const { return (k1_ + k2_ * torsion_rad * torsion_rad) * torsion_rad; }
  /// The inverse, which the report gets by Cardano's formula (eq. 38 and 39). A spring that softens (K2 < 0) has none
  /// above its largest torque: throws std::domain_error there. Below it, this is the stable one of the solutions.
  double torsion(double torque_nm) const;
  /// The largest torque (N m) that the spring carries: infinite unless it softens.
  double largest_torque() const;

 private:
  double k1_;
  double k2_;
};

/// Model 2: a gear with a spring at its output and no losses, eq. 36 to 39.
struct CompliantDrive {
  IdealDrive gear;
  CubicSpring spring{6.34e3, 0.0};

  double input_torque(double output_torque) const { return gear.input_torque(output_torque); }
  /// Eq. 38 for the flexspline's angle.
  double output_angle(double input_angle, double output_torque) const {
    return gear.output_angle(input_angle) - spring.torsion(output_torque);
  }
};

/// Model 3: compliance with structural damping, friction at three places (figure 15, eq. 40 to 44, 68, 78).
struct LossyDrive {
  IdealDrive gear;
  CubicSpring spring{6.34e3, 0.0};
  double damping_torque = 0.0;  ///< T_st, N m at 1 rad/s of torsion rate
  double damping_exponent = 1.0;
  FrictionCurve wave_generator;  ///< T_f1, by the input's velocity
  FrictionCurve teeth;           ///< T_f2, by the input's velocity
  FrictionCurve output_bearing;  ///< T_3, by the output's velocity

  double torsion(double input_angle, double output_angle) const {
    return gear.output_angle(input_angle) - output_angle;
  }
  double torsion_rate(double input_velocity, double output_velocity) const {
    return gear.output_velocity(input_velocity) - output_velocity;
  }
  /// Eq. 68.
  double structural_damping(double torsion_rate_rad_s) const;
  /// T_nfs = T_cfs of eq. 42.
  double torsion_torque(double torsion_rad, double torsion_rate_rad_s) const {
    return spring.torque(torsion_rad) + structural_damping(torsion_rate_rad_s);
  }
  /// Eq. 40 and 41 (together eq. 80), for a wave generator in motion.
  double input_torque(double torsion_torque_nm, double input_velocity) const;
  /// Eq. 43, for an output in motion.
  double output_torque(double torsion_torque_nm, double output_velocity) const;
};

}  // namespace flexspline::report
