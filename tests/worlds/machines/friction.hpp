// Friction on the motor's side of a machine, with its state.
#pragma once

#include <array>

#include "tests/worlds/machines/plant.hpp"

namespace flexspline::worlds::machines {

// What a step of the plant knows before its friction.
struct SlidingState {
  double angle_rad = 0.0, velocity_rad_s = 0.0;
  double gear_torque_nm = 0.0;                          // at the output
  double viscous_thermal = 1.0, coulomb_thermal = 1.0;  // factors of the temperature
};

class MachineFriction {
 public:
  // `parameters` as they are in this record.
  MachineFriction(const FrictionParameters& parameters, double gear_ratio, double step_s);

  // Advances by one step; the torque that resists. Writes its terms into `sample`.
  double advance(const SlidingState& state, Sample& sample);

 private:
  double over_position(double angle_rad) const;
  double turn_bristles(double level_nm, double velocity_rad_s, double& direction);
  double slip_elements(double level_nm, double velocity_rad_s, double& direction);

  const FrictionParameters& p_;
  double ratio_, step_s_;
  double bristle_nm_ = 0.0;
  std::array<double, 4> elements_{};
};

}  // namespace flexspline::worlds::machines
