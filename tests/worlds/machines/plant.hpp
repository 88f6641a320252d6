// One axis of a machine in closed position control: two inertias with a gear between them, or one that is rigid.
// Angles and torques are those of the motor, if the name does not say `output`.
#pragma once

#include <cstddef>
#include <numbers>
#include <vector>

namespace flexspline::worlds::machines {

inline constexpr double kTurn_rad = 2.0 * std::numbers::pi;
inline constexpr double kControlRate_hz = 2000.0;

// A wave over the motor's angle: cosine cos(order q) + sine sin(order q), in the unit of what it adds to.
struct Wave {
  double order = 0.0, cosine = 0.0, sine = 0.0;
  double at(double angle_rad) const;
};

struct FrictionParameters {
  double viscous_nms_rad = 0.0, coulomb_nm = 0.0;
  // The first travel after a reversal, over which friction turns round.
  double presliding_rad = 0.0;
  bool maxwell_slip = false;  // four elements; else the bristles of Canudas de Wit and others
  double bristle_damping_nms_rad = 0.0;
  double viscous_asymmetry_nms_rad = 0.0, coulomb_asymmetry_nm = 0.0;
  double stribeck_nm = 0.0, stribeck_velocity_rad_s = 1.0;
  bool stribeck_is_hess_soom = false;
  double power_law_nm = 0.0, power_law_exponent = 0.5, reference_velocity_rad_s = 1.0;
  double quadratic_drag_nms2_rad2 = 0.0;
  double load_coefficient = 0.0;  // of the torque through the gear, seen at the motor
  double viscous_temperature_1_k = 0.0, coulomb_temperature_1_k = 0.0, reference_temperature_c = 25.0;
  // Friction over the position: shares of the Coulomb friction over one period.
  std::vector<double> over_position;
  double position_period_rad = 1.0;
};

struct GearParameters {
  bool rigid = false;
  double ratio = 1.0;
  double stiffness_nm_rad = 1.0, cubic_stiffness_nm_rad3 = 0.0, damping_nms_rad = 0.0;  // at the output
  double hysteresis_nm = 0.0, hysteresis_stiffness_nm_rad = 0.0;
  Wave kinematic_error_rad;
};

struct LoadParameters {
  double inertia_kgm2 = 0.0, viscous_nms_rad = 0.0;
  double gravity_cosine_nm = 0.0, gravity_sine_nm = 0.0;
};

struct ElectricParameters {
  double torque_constant_nm_a = 0.1;
  double saturation_1_a2 = 0.0;  // torque lost: constant times this times the cube of the current
  double time_constant_s = 3e-4;
  double delay_s = 0.0;  // of the torque behind the measured current
  double limit_a = 10.0, step_a = 0.0;
};

// The position sensor that the controller reads, and the log.
struct EncoderParameters {
  double step_rad = 0.0, noise_rad = 0.0;
  double eccentricity_rad = 0.0, eccentricity_phase_rad = 0.0;
};

struct ControllerParameters {
  double bandwidth_rad_s = 30.0;
  double velocity_filter = 1.0;  // share of each new difference
  double inertia_feedforward = 1.0, viscous_feedforward = 1.0, coulomb_feedforward = 1.0;  // over the true value
};

struct Plant {
  double step_s = 5e-5;
  double rotor_inertia_kgm2 = 1e-4;
  FrictionParameters friction;
  std::vector<Wave> ripples_nm;
  GearParameters gear;
  LoadParameters load;
  ElectricParameters electric;
  EncoderParameters encoder;
  ControllerParameters controller;

  double total_inertia_kgm2() const { return rotor_inertia_kgm2 + load.inertia_kgm2 / (gear.ratio * gear.ratio); }
};

// What a record is made from; one value per tick of the controller, if not said otherwise.
struct Inputs {
  std::vector<double> angle_rad, velocity_rad_s, acceleration_rad_s2;  // as the controller is asked for
  std::vector<double> output_torque_nm, known_output_torque_nm;        // on the load; fed forward
  std::vector<double> temperature_c;
  std::vector<double> encoder_noise;                  // of unit variance
  std::vector<std::size_t> sample_step;               // steps of the plant at which the log has a sample
  double viscous_factor = 1.0, coulomb_factor = 1.0;  // of this record
};

// All that happened at one sample. Torques of friction are those that resist.
struct Sample {
  double time_s = 0.0;
  double current_a = 0.0, acting_current_a = 0.0;  // measured; behind the delay
  double angle_rad = 0.0, velocity_rad_s = 0.0, output_angle_rad = 0.0;
  double gear_torque_nm = 0.0;  // at the output
  double viscous_nm = 0.0, viscous_temperature_nm = 0.0, viscous_asymmetry_nm = 0.0, drag_nm = 0.0;
  double coulomb_asymmetry_nm = 0.0, stribeck_nm = 0.0, power_law_nm = 0.0, load_friction_nm = 0.0;
  double coulomb_temperature_nm = 0.0, position_friction_nm = 0.0;
  double direction = 0.0;  // of the bristles' load, from -1 to 1
  double ripple_nm = 0.0, saturation_nm = 0.0;
  double gravity_nm = 0.0, output_torque_nm = 0.0, temperature_c = 0.0;              // at the output
  double cubic_nm = 0.0, hysteresis_nm = 0.0, kinematic_nm = 0.0, damping_nm = 0.0;  // of the gear, at the output
};

using Log = std::vector<Sample>;

std::vector<double> column(const Log& log, double Sample::*of);

// Throws std::runtime_error where the controller does not hold the machine.
Log simulate(const Plant& plant, const Inputs& inputs);

}  // namespace flexspline::worlds::machines
