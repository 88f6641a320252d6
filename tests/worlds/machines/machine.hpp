// A drawn machine: its plant, its sensors, its records, and what is hidden in it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/worlds/machines/plant.hpp"
#include "tests/worlds/machines/reference.hpp"

namespace flexspline::worlds::machines {

enum class Kind {
  cobot_with_torque_sensors,
  cobot_without_output_encoder,
  exoskeleton,
  telescope,
  scara,
  rotary_table,
  satellite,
  bench
};

inline constexpr std::array<Kind, 8> kKinds = {Kind::cobot_with_torque_sensors,
                                               Kind::cobot_without_output_encoder,
                                               Kind::exoskeleton,
                                               Kind::telescope,
                                               Kind::scara,
                                               Kind::rotary_table,
                                               Kind::satellite,
                                               Kind::bench};

std::string_view name_of(Kind kind);

// `known`: long, and in the model. `short_travel`: real, not in the model, mostly below what a log resolves. `none`:
// turns round within a step of the plant.
enum class Presliding { known, short_travel, none };

std::string_view name_of(Presliding presliding);

enum class Balance { motor, transmission, load };

std::string_view name_of(Balance balance);

struct Sensors {
  double sample_hz = 500.0;
  double encoder_counts = 4096.0, output_encoder_counts = 0.0;
  double current_step_a = 0.0, current_noise_a = 0.0, current_coloured_a = 0.0, current_corner_hz = 1.0;
  double current_offset_a = 0.0;
  bool effort_is_torque = false;  // the log holds the torque that the drive believes in
  bool torque = false, load_torque = false, output_encoder = false, temperature = false, velocity_in_rpm = false;
  double torque_noise_nm = 0.1, torque_offset_nm = 0.0;
  Wave torque_ripple_nm;  // over the motor's angle
  double output_eccentricity_rad = 0.0;
  double jitter = 0.0;  // of the sample time, standard deviation
  bool stamps_are_true = true;
};

// What the model that the tool is given holds besides inertia, viscous and Coulomb friction.
struct BaseModel {
  bool torque_offset = false, stiffness = false, load = false, gravity = false;
};

struct HiddenEffect {
  std::string effect;
  double order = 0.0;                 // 0: the effect has none
  std::vector<std::string> accepted;  // names that cannot be distinguished from it, its own first
  double wanted_excess = 0.0;         // share by which the RMS error rises where it alone is missing
  // Drawn once, whatever the size.
  double sign = 1.0, phase_rad = 0.0, velocity_rad_s = 1.0, exponent = 0.5;
  bool maxwell_slip = false;
  double size = 0.0;  // relative to what is usual
};

struct Record {
  std::string name;
  Motion motion = Motion::sweep;
  Inputs inputs;
  Signal stamp_s;  // per sample, as logged
  double start_temperature_c = 25.0;
  std::uint64_t noise_seed = 0;
};

struct Machine {
  std::uint64_t seed = 0;
  int draw = 0;  // how many were drawn before it with this seed
  Kind kind = Kind::bench;
  bool stress = false;
  Presliding presliding = Presliding::none;
  Plant plant;
  Sensors sensors;
  Plant plain_plant;  // without what is hidden
  Sensors plain_sensors;
  BaseModel base;
  MotionLimits limits;
  double rated_current_a = 1.0;  // without what is kept in reserve
  double human_torque_nm = 0.0;  // of who wears it, at the output
  double bench_torque_nm = 0.0;  // of the load machine, at the output
  double account_cutoff_hz = 20.0;
  std::optional<HiddenEffect> hidden;
  std::vector<Record> fit, holdout;
};

// What the log's columns hold, per sample.
struct Measured {
  Signal current_a, angle_rad, output_angle_rad, torque_nm, load_torque_nm, temperature_c, velocity_rpm;
};

// By how much the output encoder reads too much there.
double output_eccentricity_rad(const Machine& machine, const Sample& sample);

Measured measure(const Machine& machine, const Record& record, const Log& log);

}  // namespace flexspline::worlds::machines
