// Numbers of the report, in SI units.
#pragma once

#include "hil/thesis_models/dc_motor.hpp"
#include "hil/thesis_models/friction_curve.hpp"
#include "hil/thesis_models/harmonic_drive.hpp"

namespace flexspline::report::published {

inline constexpr double kSampleS = 1e-3;           ///< section 5.1
inline constexpr double kGearRatio = 100.0;        ///< section 1.2
inline constexpr double kRatedTorqueNm = 40.0;     ///< section 1.2
inline constexpr double kMotorRatedTorque = 0.15;  ///< section 1.2
inline constexpr double kTorqueConstant = 0.0543;  ///< section 1.2; table 3 identifies 0.0428

/// Table 1, first row: the motor of the simulation check. Its friction is that of eq. 52.
inline DcMotor simulated_motor() {
  return {0.1, 1e3, 1e-4, FrictionCurve::symmetric({0.01, 0.05, 0.01, 0.05}, Stribeck::hess_soom)};
}

/// Table 3, final decision, with the inertia of table 2; the limit gives the motor its rated torque (no figure).
inline DcMotor identified_motor() {
  return {4.275e-2, kMotorRatedTorque / 4.275e-2, 4.376e-5, {{4.2e-5, 1.1e-2}, {4.2e-5, 1.0e-2}}};
}

/// Tables 7 and 8, averages: all friction on the motor shaft of the drive, T_fm + T_f1 + T_f2.
inline constexpr double kEffectiveInertia = 1.04e-4;
inline FrictionCurve total_friction() {
  return {{3.73e-4, 4.60e-2, -7.61e-3, 0.1}, {3.52e-4, 4.43e-2, -2.03e-2, 0.1}, Stribeck::tustin};
}

/// Eq. 79: stiffness and structural damping; table 6: the cubic model, which the report rejects.
inline constexpr double kStiffness = 6.34e3;
inline constexpr double kDampingTorque = 57.2;
inline constexpr double kDampingExponent = 0.5;
inline CubicSpring cubic_spring() {
  return {5.66e3, 1.10e9};
}

}  // namespace flexspline::report::published
