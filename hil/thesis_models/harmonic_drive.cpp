#include "hil/thesis_models/harmonic_drive.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace flexspline::report {

CubicSpring::CubicSpring(double k1, double k2) : k1_(k1), k2_(k2) {
  if (!(k1_ > 0.0) || !std::isfinite(k1_) || !std::isfinite(k2_))
    throw std::invalid_argument("a flexspline needs a positive linear stiffness and a finite cubic one, not K1 = " +
                                std::to_string(k1_) + ", K2 = " + std::to_string(k2_));
}

double CubicSpring::largest_torque() const {
  if (k2_ >= 0.0) return std::numeric_limits<double>::infinity();
  // Where the slope K1 + 3 K2 x^2 is zero.
  return 2.0 / 3.0 * k1_ * std::sqrt(k1_ / (-3.0 * k2_));
}

// With x = 2 r y and r = sqrt(K1 / (3 abs(K2))), K1 x + K2 x^3 = T becomes 3 y +- 4 y^3 = s, s = 1.5 T / (K1 r): the
// triple-angle formula of sinh for a spring that hardens, of sin for one that softens. Neither takes a difference of
// nearly equal numbers, as the two cube roots of eq. 38 do.
double CubicSpring::torsion(double torque_nm) const {
  const double linear = torque_nm / k1_;
  const double s = 1.5 * linear * std::sqrt(3.0 * std::abs(k2_) / k1_);
  if (std::abs(s) < 1e-9) return linear;
  if (k2_ > 0.0) return linear * 3.0 * std::sinh(std::asinh(s) / 3.0) / s;
  if (std::abs(s) > 1.0)
    throw std::domain_error("the flexspline cannot carry " + std::to_string(torque_nm) +
                            " N m: with its negative cubic stiffness the torque is at most " +
                            std::to_string(largest_torque()) + " N m. Use a smaller torque or a stiffer spring.");
  return linear * 3.0 * std::sin(std::asin(s) / 3.0) / s;
}

double LossyDrive::structural_damping(double torsion_rate_rad_s) const {
  const double magnitude = damping_torque * std::pow(std::abs(torsion_rate_rad_s), damping_exponent);
  return std::copysign(magnitude, torsion_rate_rad_s);
}

double LossyDrive::input_torque(double torsion_torque_nm, double input_velocity) const {
  return gear.input_torque(torsion_torque_nm) + wave_generator.torque(input_velocity) + teeth.torque(input_velocity);
}

double LossyDrive::output_torque(double torsion_torque_nm, double output_velocity) const {
  return torsion_torque_nm - output_bearing.torque(output_velocity);
}

}  // namespace flexspline::report
