#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/worlds/drives/control.hpp"
#include "tests/worlds/drives/motions.hpp"
#include "tests/worlds/drives/plant.hpp"

namespace flexspline::worlds::drives {

/// What measures, and when.
struct Sensors {
  double rate_hz = 1000.0;
  double motor_counts = 4096.0;   // per motor turn
  double output_counts = 0.0;     // per output turn; 0: no output encoder
  double eccentricity_rad = 0.0;  // error of the motor's encoder, once a turn
  double eccentricity_phase_rad = 0.0;
  bool has_velocity = false;
  double velocity_noise_rad_s = 0.0;
  bool has_temperature = false;
  bool has_torque = false;       // flange between gear and load
  bool has_load_torque = false;  // of the brake
  double torque_noise_nm = 0.0;  // of either, at the output
  double current_noise_a = 0.0;
  double current_step_a = 0.0;
  double current_offset_a = 0.0;
  double current_delay_s = 0.0;   // the current's column is that much late
  double current_filter_s = 0.0;  // its time constant
  double position_delay_s = 0.0;  // the positions' columns are that much late
  double jitter_s = 0.0;          // of the instants
  bool states_jitter = true;      // time_s holds the true instants
  bool knows_zero = true;         // the motor's angle has the same zero in all records
};

struct Disturbances {
  double motor_nm = 0.0;  // RMS of the coloured noise of the torque, at the motor
  double motor_hz = 1.0;  // its corner
  double wind_nm = 0.0;   // RMS at the output
  double wind_hz = 0.1;
};

/// Level of the brake over time: stairs, or a slow wave.
struct Brake {
  std::vector<double> levels_nm;
  bool is_wave = false;
};

struct RecordPlan {
  std::string name;
  bool is_holdout = false;
  Motion motion;
  double start_rad = 0.0;  // of the motor
  double coulomb_scale = 1.0;
  double viscous_scale = 1.0;
  double drift_share = 0.0;  // of both, from the record's start to its end
  double temperature_start_c = 25.0;
  double temperature_end_c = 25.0;
  Brake brake;
  std::uint64_t noise_seed = 0;
};

/// A number of the hidden effect, for the reader of truth.json.
using NamedNumber = std::pair<std::string, double>;

struct Hidden {
  std::string effect;  // name in the catalogue; empty: nothing is hidden
  double order = 0.0;  // of a ripple, per motor turn
  std::vector<NamedNumber> parameters;
};

/// One machine with its records.
struct Case {
  std::string kind;
  std::uint64_t seed = 0;
  int drawn_again = 0;
  Mechanics mechanics;
  double viscous_fall_1_c = 0.0;  // viscous friction goes with exp(-this (temperature - reference))
  double reference_c = 25.0;
  ControlSettings control;
  Sensors sensors;
  Disturbances disturbances;
  double rated_current_a = 1.0;
  double rated_velocity_rad_s = 1.0;
  double step_s = 5e-5;
  int pole_pairs = 0;  // 0: the user does not state it
  bool models_gravity = false;
  std::vector<Ripple> residual_ripples;  // those of the mechanics that are not hidden
  Hidden hidden;
  std::vector<RecordPlan> records;
};

}  // namespace flexspline::worlds::drives
