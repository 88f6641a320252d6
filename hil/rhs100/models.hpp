// Texts of the models that the sets are identified with: known values are fixed, values to estimate are missing.
#pragma once

#include <string>

namespace flexspline::rhs100 {

std::string compliance_model();
std::string cubic_compliance_model();
std::string fast_friction_model();
/// Averages of table 7 fixed, and the Stribeck velocity of table 8.
std::string slow_friction_model();
/// Inertia supplied, as in tables 2 and 3; the data sheet's torque constant with an error to estimate.
std::string motor_model();
/// Table 1 without its Stribeck term.
std::string simulated_motor_model();
/// With it; the parameters identified on the composite have to be fixed first, as in section 3.4.
std::string simulated_stribeck_model();
/// The whole drive, for all of its experiments at once.
std::string drive_model();

}  // namespace flexspline::rhs100
