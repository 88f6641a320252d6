#pragma once

namespace flexspline::worlds::drives {

enum class Presliding { kRigid, kDahl, kElastoPlastic };

/// Friction of the motor's shaft. What is zero is not there.
struct FrictionLaw {
  double coulomb_nm = 0.0;
  double viscous_nms_rad = 0.0;
  Presliding presliding = Presliding::kRigid;
  double presliding_rad = 0.0;  // torque of Coulomb friction over the stiffness of the contact
  double stribeck_positive_nm = 0.0;
  double stribeck_negative_nm = 0.0;
  double stribeck_velocity_rad_s = 1.0;
  double power_nm = 0.0;  // at reference_velocity_rad_s
  double power_exponent = 0.5;
  double reference_velocity_rad_s = 1.0;
  double quadratic_nms2_rad2 = 0.0;
  double coulomb_asymmetry_nm = 0.0;
  double viscous_asymmetry_nms_rad = 0.0;
  double load_coefficient = 0.0;  // of the torque in the gear, at the motor
};

/// What changes from record to record and with time.
struct FrictionState {
  double coulomb_scale = 1.0;
  double viscous_scale = 1.0;
  double load_nm = 0.0;  // torque in the gear over its ratio
};

/// Level of the dry friction in N m, not negative, that resists motion in `direction` (+1 or -1): Coulomb's law with
/// the rise at low speed of Tustin (1947), grease that thins by shear (power law) and a part that goes with the load
/// (mesh, capstan).
double dry_level_nm(const FrictionLaw& law, const FrictionState& state, double velocity_rad_s, double direction);

/// Friction in N m that is a function of the velocity, positive at positive velocity: viscous by direction, and drag by
/// its square.
double fluid_friction_nm(const FrictionLaw& law, const FrictionState& state, double velocity_rad_s);

/// All friction in N m at steady motion, 0 at rest.
double steady_friction_nm(const FrictionLaw& law, const FrictionState& state, double velocity_rad_s);

/// Velocity in rad/s at the end of a step under rigid dry friction: `free_velocity_rad_s` less the friction's impulse,
/// at rest where that impulse suffices. Time stepping by Moreau (1988). `step_over_inertia` is in s/(kg m^2).
double after_dry_friction(double free_velocity_rad_s, double level_positive_nm, double level_negative_nm,
                          double step_over_inertia);

/// Torque in N m of a contact after `travel_rad`, whose torque was `torque_nm`. Dahl (1968), by his law's exact
/// solution; elasto-plastic by Dupont et al. (IEEE Trans. Automatic Control 47, 2002): elastic up to 0.7 of the level,
/// so that it does not creep at rest.
double contact_torque_nm(const FrictionLaw& law, double torque_nm, double travel_rad, double level_nm);

}  // namespace flexspline::worlds::drives
