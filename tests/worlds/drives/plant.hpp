#pragma once

#include <vector>

#include "tests/worlds/drives/friction.hpp"

namespace flexspline::worlds::drives {

/// Torque a cos(k q) + b sin(k q) over the motor's angle.
struct Ripple {
  double order = 0.0;
  double cosine_nm = 0.0;
  double sine_nm = 0.0;
};

/// A motor and a load, coupled rigidly or by a spring behind the gear. What is zero is not there.
struct Mechanics {
  double gear_ratio = 1.0;
  double torque_constant_nm_a = 1.0;
  double motor_inertia_kgm2 = 1.0;
  double output_inertia_kgm2 = 0.0;
  bool is_rigid = true;
  double stiffness_nm_rad = 0.0;  // at the output, as the next three
  double cubic_nm_rad3 = 0.0;
  double damping_nms_rad = 0.0;
  double backlash_rad = 0.0;  // half of the gap
  double gravity_nm = 0.0;    // m g l sin(qo + phase)
  double gravity_phase_rad = 0.0;
  double saturation_1_a2 = 0.0;  // torque is Km (i - k i^3)
  std::vector<Ripple> ripples;
  FrictionLaw friction;
};

/// What acts on the plant during a step.
struct Inputs {
  double current_a = 0.0;
  double motor_noise_nm = 0.0;  // accelerates
  double load_noise_nm = 0.0;   // accelerates, at the output
  double brake_nm = 0.0;        // level of a brake at the output, which resists motion only
  double coulomb_scale = 1.0;
  double viscous_scale = 1.0;
};

struct State {
  double motor_position_rad = 0.0;
  double motor_velocity_rad_s = 0.0;
  double output_position_rad = 0.0;
  double output_velocity_rad_s = 0.0;
  double gear_torque_nm = 0.0;     // at the output, positive when the motor drives forward
  double contact_torque_nm = 0.0;  // dry friction of the motor's shaft
  double brake_torque_nm = 0.0;    // of the brake, positive resists
};

/// Torque in N m at the motor that resists and is a function of its angle (cogging: Hendershot and Miller, ch. 5).
double ripple_torque_nm(const Mechanics& m, double motor_position_rad);

/// Torque in N m at the output of a link that is not balanced, positive resists.
double gravity_torque_nm(const Mechanics& m, double output_position_rad);

/// Torque in N m of the spring behind the gear at a torsion: dead zone, then linear and cubic spring, and a damper.
double spring_torque_nm(const Mechanics& m, double torsion_rad, double torsion_rate_rad_s);

/// The equations of motion of one or two masses with set-valued friction (Brogliato, Nonsmooth Mechanics, 3rd ed., ch.
/// 5), in Moreau's midpoint rule: of second order where nothing sticks, and what sticks does not creep.
class Plant {
 public:
  Plant(const Mechanics& mechanics, const State& start) : m_(mechanics), state_(start) {}

  const State& state() const { return state_; }
  void step(const Inputs& inputs, double step_s);

 private:
  void step_rigid(const Inputs& inputs, double step_s, double motor_torque_nm, double motor_middle_rad);
  void step_flexible(const Inputs& inputs, double step_s, double motor_torque_nm, double motor_middle_rad);
  double velocity_after(const Inputs& inputs, double torque_nm, double inertia_kgm2, double brake_nm, double step_s);

  Mechanics m_;
  State state_;
};

}  // namespace flexspline::worlds::drives
