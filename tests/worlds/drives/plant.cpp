#include "tests/worlds/drives/plant.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::worlds::drives {

double ripple_torque_nm(const Mechanics& m, double motor_position_rad) {
  double torque = 0.0;
  for (const Ripple& ripple : m.ripples) {
    const double angle = ripple.order * motor_position_rad;
    torque += ripple.cosine_nm * std::cos(angle) + ripple.sine_nm * std::sin(angle);
  }
  return torque;
}

double gravity_torque_nm(const Mechanics& m, double output_position_rad) {
  return m.gravity_nm == 0.0 ? 0.0 : m.gravity_nm * std::sin(output_position_rad + m.gravity_phase_rad);
}

double spring_torque_nm(const Mechanics& m, double torsion_rad, double torsion_rate_rad_s) {
  const double beyond = torsion_rad - std::clamp(torsion_rad, -m.backlash_rad, m.backlash_rad);
  if (m.backlash_rad > 0.0 && beyond == 0.0) return 0.0;
  const double torque =
      (m.stiffness_nm_rad + m.cubic_nm_rad3 * beyond * beyond) * beyond + m.damping_nms_rad * torsion_rate_rad_s;
  // Teeth push and do not pull.
  if (m.backlash_rad > 0.0 && torque * beyond < 0.0) return 0.0;
  return torque;
}

double Plant::velocity_after(const Inputs& inputs, double torque_nm, double inertia_kgm2, double brake_nm,
                             double step_s) {
  const FrictionLaw& law = m_.friction;
  const double velocity = state_.motor_velocity_rad_s;
  const FrictionState friction{inputs.coulomb_scale, inputs.viscous_scale, state_.gear_torque_nm / m_.gear_ratio};
  const double fluid = fluid_friction_nm(law, friction, velocity);
  const double step_over_inertia = step_s / inertia_kgm2;
  double free = velocity + step_over_inertia * (torque_nm - fluid);
  double level_positive = dry_level_nm(law, friction, velocity, 1.0);
  double level_negative = dry_level_nm(law, friction, velocity, -1.0);
  double contact = 0.0;
  if (law.presliding != Presliding::kRigid) {
    const double level = velocity >= 0.0 ? level_positive : level_negative;
    contact = contact_torque_nm(law, state_.contact_torque_nm, velocity * step_s, level);
    free -= step_over_inertia * contact;
    level_positive = level_negative = 0.0;
  }
  const double next = after_dry_friction(free, level_positive + brake_nm, level_negative + brake_nm, step_over_inertia);
  const double set_valued = (free - next) / step_over_inertia;
  const double brake_share = brake_nm > 0.0 ? brake_nm / (brake_nm + std::max(level_positive, 1e-300)) : 0.0;
  state_.brake_torque_nm = set_valued * brake_share * m_.gear_ratio;
  state_.contact_torque_nm = contact + set_valued * (1.0 - brake_share);
  return next;
}

void Plant::step_rigid(const Inputs& inputs, double step_s, double motor_torque_nm, double motor_middle_rad) {
  const double ratio = m_.gear_ratio;
  const double inertia = m_.motor_inertia_kgm2 + m_.output_inertia_kgm2 / (ratio * ratio);
  const double output_middle = motor_middle_rad / ratio;
  const double load = gravity_torque_nm(m_, output_middle) - inputs.load_noise_nm;
  const double before = state_.motor_velocity_rad_s;
  const double after = velocity_after(inputs, motor_torque_nm - load / ratio, inertia, inputs.brake_nm / ratio, step_s);
  state_.motor_velocity_rad_s = after;
  state_.motor_position_rad = motor_middle_rad + 0.5 * step_s * after;
  state_.output_velocity_rad_s = after / ratio;
  state_.output_position_rad = state_.motor_position_rad / ratio;
  state_.gear_torque_nm = m_.output_inertia_kgm2 * (after - before) / (ratio * step_s) + load + state_.brake_torque_nm;
}

void Plant::step_flexible(const Inputs& inputs, double step_s, double motor_torque_nm, double motor_middle_rad) {
  const double ratio = m_.gear_ratio;
  const double output_middle = state_.output_position_rad + 0.5 * step_s * state_.output_velocity_rad_s;
  const double torsion_rate = state_.motor_velocity_rad_s / ratio - state_.output_velocity_rad_s;
  state_.gear_torque_nm = spring_torque_nm(m_, motor_middle_rad / ratio - output_middle, torsion_rate);
  const double after =
      velocity_after(inputs, motor_torque_nm - state_.gear_torque_nm / ratio, m_.motor_inertia_kgm2, 0.0, step_s);
  const double over_inertia = step_s / m_.output_inertia_kgm2;
  const double load = gravity_torque_nm(m_, output_middle) - inputs.load_noise_nm;
  const double free = state_.output_velocity_rad_s + over_inertia * (state_.gear_torque_nm - load);
  const double output_after = after_dry_friction(free, inputs.brake_nm, inputs.brake_nm, over_inertia);
  state_.brake_torque_nm = (free - output_after) / over_inertia;
  state_.motor_velocity_rad_s = after;
  state_.motor_position_rad = motor_middle_rad + 0.5 * step_s * after;
  state_.output_velocity_rad_s = output_after;
  state_.output_position_rad = output_middle + 0.5 * step_s * output_after;
}

void Plant::step(const Inputs& inputs, double step_s) {
  const double middle = state_.motor_position_rad + 0.5 * step_s * state_.motor_velocity_rad_s;
  const double current = inputs.current_a;
  const double motor = m_.torque_constant_nm_a * (current - m_.saturation_1_a2 * current * current * current);
  const double torque = motor - ripple_torque_nm(m_, middle) + inputs.motor_noise_nm;
  if (m_.is_rigid) {
    step_rigid(inputs, step_s, torque, middle);
  } else {
    step_flexible(inputs, step_s, torque, middle);
  }
}

}  // namespace flexspline::worlds::drives
