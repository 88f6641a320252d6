#include "tests/worlds/drives/draw.hpp"

namespace flexspline::worlds::drives {

// Orders of magnitude as in: legs, Katz (MIT thesis, 2018) and Wensing et al. (IEEE Trans. Robotics 33, 2017);
// telescope, Bely (The Design and Construction of Large Optical Telescopes, ch. 7); cable instrument, Hannaford et al.
// (IEEE Trans. Biomedical Engineering 60, 2013); gimbal, Hilkert (IEEE Control Systems Magazine 28, 2008); ball screw,
// Altintas et al. (CIRP Annals 60, 2011); motors, makers' catalogues.
namespace {

Kind leg() {
  return {
      .name = "leg",
      .gear_ratio = {6, 9},
      .motor_inertia_kgm2 = {4e-5, 2e-4},
      .inertia_ratio = {1.0, 5.0},
      .antiresonance_hz = {25, 60},
      .torque_constant_nm_a = {0.07, 0.14},
      .rated_current_a = {8, 15},
      .coulomb_share = {0.02, 0.07},
      .viscous_share = {0.01, 0.05},
      .rated_velocity_rad_s = {120, 220},
      .used_velocity = {0.1, 0.35},
      .range_turns = {0.12, 0.28},
      .band_hz = {0.6, 2.0},
      .record_s = {5, 8},
      .rates_hz = {500, 1000, 2000},
      .motor_counts = {4096, 16384, 65536},
      .presliding_chance = 0.2,
      .presliding_rad = {0.0025, 0.015},
      .motions = {"walking", "walking", "minimum_jerk", "multisine", "sine", "point_to_point"},
      .hidden = {"stribeck_gaussian", "load_dependent_friction", "coulomb_asymmetry", "viscous_asymmetry",
                 "current_delay", "torque_constant_saturation", "temperature_viscous", "torque_ripple"},
  };
}

Kind antenna() {
  return {
      .name = "antenna",
      .gear_ratio = {300, 3000},
      .motor_inertia_kgm2 = {2e-4, 1e-3},
      .inertia_ratio = {0.5, 3.0},
      .antiresonance_hz = {3, 8},
      .torque_constant_nm_a = {0.2, 0.6},
      .rated_current_a = {3, 8},
      .coulomb_share = {0.05, 0.2},
      .viscous_share = {0.05, 0.2},
      .rated_velocity_rad_s = {150, 300},
      .used_velocity = {0.1, 0.6},
      .range_turns = {0.05, 0.9},
      .band_hz = {0.03, 0.15},
      .record_s = {14, 24},
      .rates_hz = {250, 500},
      .motor_counts = {4096, 16384, 65536},
      .presliding_chance = 0.25,
      .presliding_rad = {0.01, 0.075},
      .motions = {"tracking", "raster", "point_to_point", "point_to_point", "sine", "speed_steps"},
      .hidden = {"stribeck_gaussian", "power_law_friction", "viscous_asymmetry", "coulomb_asymmetry", "torque_ripple",
                 "current_offset", "dahl_friction", "temperature_viscous"},
  };
}

Kind rotary_table() {
  return {
      .name = "rotary-table",
      .gear_ratio = {1, 1},
      .motor_inertia_kgm2 = {0.02, 0.2},
      .inertia_ratio = {0.3, 3.0},
      .antiresonance_hz = {0, 0},
      .torque_constant_nm_a = {1.5, 6.0},
      .rated_current_a = {3, 8},
      .coulomb_share = {0.02, 0.1},
      .viscous_share = {0.02, 0.1},
      .rated_velocity_rad_s = {15, 35},
      .used_velocity = {0.1, 0.6},
      .range_turns = {0.25, 3.0},
      .band_hz = {0.3, 2.5},
      .record_s = {4, 7},
      .rates_hz = {1000, 2000, 4000},
      .motor_counts = {131072, 1048576, 8388608},
      .presliding_chance = 0.25,
      .presliding_rad = {5e-05, 0.0005},
      .motions = {"point_to_point", "point_to_point", "sine", "chirp", "multisine", "speed_steps"},
      .hidden = {"torque_ripple", "stribeck_gaussian", "dahl_friction", "current_delay", "gravity",
                 "power_law_friction", "coulomb_asymmetry", "quadratic_drag"},
  };
}

Kind wheel_hub() {
  return {
      .name = "wheel-hub",
      .gear_ratio = {4, 20},
      .motor_inertia_kgm2 = {1e-4, 6e-4},
      .inertia_ratio = {0.5, 5.0},
      .antiresonance_hz = {0, 0},
      .torque_constant_nm_a = {0.06, 0.2},
      .rated_current_a = {8, 20},
      .coulomb_share = {0.02, 0.08},
      .viscous_share = {0.03, 0.12},
      .rated_velocity_rad_s = {150, 350},
      .used_velocity = {0.3, 0.85},
      .range_turns = {1e4, 1e4},
      .band_hz = {0.1, 0.6},
      .record_s = {8, 12},
      .rates_hz = {250, 500, 1000},
      .motor_counts = {1024, 4096, 16384},
      .presliding_chance = 0.2,
      .presliding_rad = {0.01, 0.05},
      .motions = {"drive_cycle", "drive_cycle", "speed_steps", "multisine", "raster"},
      .hidden = {"quadratic_drag", "temperature_viscous", "torque_constant_saturation", "stribeck_gaussian",
                 "viscous_asymmetry", "current_offset", "power_law_friction"},
  };
}

Kind cable_instrument() {
  return {
      .name = "cable-instrument",
      .gear_ratio = {10, 30},
      .motor_inertia_kgm2 = {6e-7, 4e-6},
      .inertia_ratio = {0.3, 1.5},
      .antiresonance_hz = {12, 30},
      .torque_constant_nm_a = {0.015, 0.03},
      .rated_current_a = {0.5, 1.2},
      .coulomb_share = {0.08, 0.2},
      .viscous_share = {0.02, 0.1},
      .rated_velocity_rad_s = {300, 700},
      .used_velocity = {0.05, 0.25},
      .range_turns = {0.15, 0.4},
      .band_hz = {0.2, 2.0},
      .record_s = {6, 10},
      .rates_hz = {500, 1000, 2000},
      .motor_counts = {2000, 4096, 16384},
      .presliding_chance = 0.4,
      .presliding_rad = {0.015, 0.1},
      .motions = {"minimum_jerk", "minimum_jerk", "sine", "multisine", "wander", "raster"},
      .hidden = {"dahl_friction", "stribeck_gaussian", "gravity", "coulomb_asymmetry", "current_delay",
                 "viscous_asymmetry"},
  };
}

Kind gimbal() {
  return {
      .name = "gimbal",
      .gear_ratio = {1, 1},
      .motor_inertia_kgm2 = {2e-4, 4e-3},
      .inertia_ratio = {0.2, 2.0},
      .antiresonance_hz = {0, 0},
      .torque_constant_nm_a = {0.08, 0.4},
      .rated_current_a = {1, 3},
      .coulomb_share = {0.02, 0.08},
      .viscous_share = {0.01, 0.06},
      .rated_velocity_rad_s = {15, 40},
      .used_velocity = {0.06, 0.25},
      .range_turns = {0.2, 0.45},
      .band_hz = {0.2, 3.0},
      .record_s = {6, 9},
      .rates_hz = {500, 1000, 2000},
      .motor_counts = {16384, 65536, 524288},
      .presliding_chance = 0.3,
      .presliding_rad = {0.00015, 0.001},
      .motions = {"wander", "wander", "sine", "chirp", "raster", "point_to_point"},
      .hidden = {"gravity", "torque_ripple", "dahl_friction", "current_offset", "current_delay", "stribeck_gaussian"},
  };
}

Kind ball_screw() {
  return {
      .name = "ball-screw",
      .gear_ratio = {1, 1},
      .motor_inertia_kgm2 = {5e-5, 4e-4},
      .inertia_ratio = {0.3, 2.0},
      .antiresonance_hz = {40, 90},
      .torque_constant_nm_a = {0.4, 0.8},
      .rated_current_a = {3, 8},
      .coulomb_share = {0.05, 0.18},
      .viscous_share = {0.03, 0.15},
      .rated_velocity_rad_s = {200, 400},
      .used_velocity = {0.2, 0.7},
      .range_turns = {4, 30},
      .band_hz = {0.3, 2.0},
      .record_s = {4, 6},
      .rates_hz = {1000, 2000, 4000},
      .motor_counts = {8192, 131072, 1048576},
      .presliding_chance = 0.25,
      .presliding_rad = {0.0015, 0.01},
      .motions = {"point_to_point", "point_to_point", "sine", "multisine", "raster", "speed_steps"},
      .hidden = {"stribeck_gaussian", "temperature_viscous", "power_law_friction", "coulomb_asymmetry", "torque_ripple",
                 "viscous_asymmetry", "current_delay", "torque_constant_saturation"},
  };
}

Kind dynamometer() {
  return {
      .name = "dynamometer",
      .gear_ratio = {20, 100},
      .motor_inertia_kgm2 = {5e-5, 3e-4},
      .inertia_ratio = {0.3, 2.0},
      .antiresonance_hz = {15, 40},
      .torque_constant_nm_a = {0.05, 0.15},
      .rated_current_a = {4, 9},
      .coulomb_share = {0.04, 0.12},
      .viscous_share = {0.04, 0.15},
      .rated_velocity_rad_s = {200, 350},
      .used_velocity = {0.2, 0.7},
      .range_turns = {1e3, 1e3},
      .band_hz = {0.2, 1.5},
      .record_s = {6, 9},
      .rates_hz = {1000, 2000},
      .motor_counts = {4096, 16384, 65536},
      .presliding_chance = 0.2,
      .presliding_rad = {0.005, 0.03},
      .motions = {"speed_steps", "speed_steps", "sine", "multisine", "chirp", "raster"},
      .hidden = {"load_dependent_friction", "torque_constant_saturation", "cubic_stiffness", "backlash",
                 "stribeck_gaussian", "torque_ripple", "temperature_viscous"},
  };
}

}  // namespace

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {leg(),    antenna(),    rotary_table(), wheel_hub(), cable_instrument(),
                                        gimbal(), ball_screw(), dynamometer()};
  return all;
}

}  // namespace flexspline::worlds::drives
