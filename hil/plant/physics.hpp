#pragma once

#include "hil/plant/parameters.hpp"
#include "hil/plant/two_mass.hpp"

namespace flexspline::plant {

/// The numbers of all effects that are present. Throws std::invalid_argument for an effect type the plant cannot
/// simulate, for one that is present twice but must not be, and for a missing parameter.
Physics physics_of(const Drive& drive);

/// Errors of sensors and amplifier.
struct SensorErrors {
  double current_offset_a = 0.0;  ///< read at zero current
  double current_delay_s = 0.0;   ///< delay of the current at the motor after the logged one
  double torque_offset_nm = 0.0;
  double torque_gain = 1.0;
  double torsion_zero_rad = 0.0;      ///< torsion when the positions say that there is none
  std::vector<Ripple> torque_ripple;  ///< added to the torque's reading, N m over the motor angle
};
SensorErrors sensor_errors_of(const Drive& drive);

}  // namespace flexspline::plant
