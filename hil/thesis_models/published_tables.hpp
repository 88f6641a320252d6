// The rows of the report's tables 4, 6, 7 and 8, and the legible part of table 3, in SI units; experiments are named as
// there: amplitude in percent, wave form, frequency in tenths of a hertz.
#pragma once

#include <array>

namespace flexspline::report::published {

/// Table 4 (without cubic stiffness) or 6 (with it): structural damping T_st |v|^alpha s(v), v in rad/s at the output.
struct ComplianceRow {
  const char* experiment;
  double stiffness;  ///< N m/rad
  double cubic;      ///< N m/rad^3
  double damping;    ///< N m
};

/// Table 4, alpha = 1/2.
inline constexpr std::array<ComplianceRow, 4> kTable4{{
    {"100-8", 5.4610e3, 0.0, 85.965},
    {"50-8", 6.9288e3, 0.0, 35.328},
    {"50-1", 6.0779e3, 0.0, 61.365},
    {"50-7", 6.8971e3, 0.0, 46.061},
}};

/// Table 4, alpha = 1/3.
inline constexpr std::array<ComplianceRow, 4> kTable4Third{{
    {"100-8", 5.4227e3, 0.0, 33.776},
    {"50-8", 6.8188e3, 0.0, 11.736},
    {"50-1", 5.9653e3, 0.0, 21.458},
    {"50-7", 6.8006e3, 0.0, 18.111},
}};

/// Table 6.
inline constexpr std::array<ComplianceRow, 4> kTable6{{
    {"100-8", 5.0531e3, 6.8074e7, 85.910},
    {"50-8", 6.0154e3, 3.1314e9, 35.352},
    {"50-1", 5.8859e3, 7.3199e8, 45.898},
    {"50-7", 5.6770e3, 4.8125e8, 60.997},
}};

/// Table 7: all that rests on the motor shaft of the drive, by direction.
struct FrictionRow {
  const char* experiment;
  double inertia;           ///< J_eff, kg m^2
  double viscous_positive;  ///< N m s/rad
  double viscous_negative;
  double coulomb_positive;  ///< N m
  double coulomb_negative;
};
inline constexpr std::array<FrictionRow, 26> kTable7{{
    {"50-1-02", 0.000118, 0.00046, 0.000464, 0.0444, 0.0482},
    {"50-1-04", 0.000111, 0.000447, 0.000444, 0.0424, 0.0445},
    {"50-1-06", 0.000105, 0.00048, 0.000441, 0.048, 0.039},
    {"50-1-08", 0.000103, 0.000465, 0.000447, 0.0401, 0.0376},
    {"50-1-10", 0.000101, 0.000446, 0.000452, 0.046, 0.0314},
    {"50-1-12", 0.000102, 0.000463, 0.000426, 0.0381, 0.0346},
    {"70-1-02", 0.000122, 0.000326, 0.000306, 0.0511, 0.0549},
    {"70-1-04", 0.00011, 0.000351, 0.000303, 0.0477, 0.053},
    {"70-1-06", 0.000104, 0.000342, 0.000325, 0.0572, 0.0463},
    {"70-1-08", 0.0001, 0.000359, 0.000334, 0.0423, 0.0473},
    {"85-1-02", 0.000114, 0.000325, 0.000247, 0.0668, 0.0382},
    {"85-1-03", 0.000107, 0.00031, 0.000293, 0.0441, 0.0525},
    {"85-1-04", 0.000107, 0.000289, 0.000266, 0.0579, 0.0626},
    {"85-1-06", 9.89e-05, 0.000317, 0.000305, 0.0279, 0.063},
    {"85-1-08", 0.0001, 0.000361, 0.000337, 0.0561, 0.0231},
    {"85-4-04", 9.87e-05, 0.000312, 0.00029, 0.0414, 0.058},
    {"100-1-02", 0.000107, 0.000321, 0.000266, 0.0537, 0.0463},
    {"100-1-03", 0.000104, 0.000278, 0.000293, 0.0619, 0.0385},
    {"100-1-04", 0.000101, 0.000298, 0.000292, 0.0636, 0.0349},
    {"100-1-06", 9.85e-05, 0.000337, 0.00029, 0.0444, 0.0484},
    {"50-3-02", 9.35e-05, 0.000416, 0.000398, 0.0402, 0.0372},
    {"50-3-04", 9.85e-05, 0.000405, 0.000417, 0.0328, 0.0421},
    {"50-3-06", 9.83e-05, 0.000415, 0.000385, 0.0548, 0.0227},
    {"50-3-08", 0.000102, 0.000413, 0.000398, 0.0376, 0.0404},
    {"50-7-02", 0.000101, 0.000402, 0.000364, 0.0251, 0.0536},
    {"50-7-03", 0.0001, 0.000349, 0.000377, 0.0305, 0.0545},
}};
/// Its averages, as printed.
inline constexpr FrictionRow kTable7Average{"", 1.04e-4, 3.73e-4, 3.52e-4, 4.60e-2, 4.43e-2};

/// Table 8: amplitudes of the Stribeck term at T_ss2 = 0.1 rad/s, N m.
struct StribeckRow {
  const char* experiment;
  double positive;
  double negative;
};
inline constexpr std::array<StribeckRow, 15> kTable8{{
    {"18-3-02", -0.0065007, -0.024456},
    {"18-3-04", -0.0067935, -0.019273},
    {"18-3-06", -0.0063506, -0.017485},
    {"18-3-08", -0.0062506, -0.011929},
    {"18-3-10", -0.0083866, -0.014234},
    {"20-3-04", -0.0092358, -0.024831},
    {"20-3-06", -0.004638, -0.018455},
    {"20-3-08", -0.011474, -0.016857},
    {"20-3-10", -0.0090822, -0.014842},
    {"22-3-02", -0.011461, -0.026649},
    {"22-3-04", -0.0078445, -0.020859},
    {"22-3-06", -0.0078609, -0.019323},
    {"25-3-02", -0.0048664, -0.028397},
    {"25-3-04", -0.0080271, -0.019585},
    {"25-3-06", -0.0072609, -0.01865},
}};
inline constexpr double kTable8Velocity = 0.1;  ///< rad/s
inline constexpr StribeckRow kTable8Average{"", -7.61e-3, -2.03e-2};

/// Table 3: its last column, the only one legible in the scan; saw-tooth, square, sine, composite. N m.
inline constexpr std::array<double, 4> kTable3CoulombPositive{1.33e-2, 1.29e-2, 1.25e-2, 1.16e-2};

}  // namespace flexspline::report::published
