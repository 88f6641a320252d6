// The whole test bed, made of its blocks: motor, harmonic drive (model 3) and load, free (figure 17) or locked (figure
// 18).
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "hil/thesis_models/dc_motor.hpp"
#include "hil/thesis_models/friction_block.hpp"
#include "hil/thesis_models/harmonic_drive.hpp"

namespace flexspline::report {

enum class Load { free, locked };

struct DriveSystemParts {
  DcMotor motor;  ///< its inertia includes everything that turns with the wave generator, J_eff of eq. 81
  LossyDrive drive;
  double output_inertia = 0.0;  ///< J_out of eq. 45, kg m^2; not read where the load is locked
};

struct SystemState {
  double input_angle = 0.0;  ///< theta_wg, rad
  double input_velocity = 0.0;
  double output_angle = 0.0;  ///< theta_fs, rad
  double output_velocity = 0.0;
};

/// One entry per sample, the first at time zero.
struct SystemTrace {
  std::vector<SystemState> state;
  std::vector<double> torque_nm;          ///< T_nfs of eq. 42, the torque that the strain gauges measure
  std::vector<double> input_friction_nm;  ///< torque of the friction block on the motor shaft
};

/// Integrates by Runge-Kutta of fourth order (section 5.1) with explicit friction blocks; with the implicit one, by
/// backward Euler with stiffness, damping and both frictions solved together.
class DriveSystem {
 public:
  /// `step_s` is the integration step; the report's is 1 ms. Throws std::invalid_argument where a moving inertia is not
  /// positive or the blocks refuse their numbers.
  DriveSystem(DriveSystemParts parts, Load load, FrictionMethod method, double step_s);

  /// Advances by one step from `time_s`, under `current_a` (A) as a function of time (s).
  SystemState step(const SystemState& from, double time_s, const std::function<double(double)>& current_a) const;
  /// `samples` samples, `steps_per_sample` steps apart.
  SystemTrace run(SystemState from, const std::function<double(double)>& current_a, std::size_t samples,
                  int steps_per_sample = 1) const;

  double torque(const SystemState& state) const;
  const FrictionBlock& input_friction() const { return *input_; }
  const FrictionBlock* output_friction() const { return output_.get(); }  ///< null where the load is locked

 private:
  SystemState runge_kutta(const SystemState& from, double time_s, const std::function<double(double)>& current_a) const;
  SystemState backward_euler(const SystemState& from, double current_a) const;

  DriveSystemParts parts_;
  bool implicit_;
  double step_s_;
  std::unique_ptr<FrictionBlock> input_;
  std::unique_ptr<FrictionBlock> output_;
};

}  // namespace flexspline::report
