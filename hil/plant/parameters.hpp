#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexspline::plant {

/// One number of an effect. `scaled` marks the numbers that an effect size multiplies: the torque, or a corresponding
/// one.
struct Parameter {
  std::string key;
  std::string unit;
  double value = 0.0;
  bool scaled = false;
};

/// One physical effect of the drive, by its name in the catalogue of effects. Effects with `catalogue == false` are
/// truths that no library effect describes exactly; they can be hidden, but cannot be in a model.
struct Effect {
  std::string type;
  bool present = false;
  bool hidden = false;
  bool catalogue = true;
  std::vector<Parameter> parameters;

  /// The value of a parameter; throws std::invalid_argument naming effect and key where there is none.
  double value(std::string_view key) const;
  Parameter& parameter(std::string_view key);
  bool has(std::string_view key) const;
  /// "torque_ripple:2" where the effect has an order, otherwise the type.
  std::string label() const;
};

/// One measured column. Noise is white with a standard deviation of `noise_share` times the record's peak, but at least
/// `noise_floor`; `correlation` makes it an AR(1) process with that coefficient and the same standard deviation.
struct Sensor {
  double noise_share = 0.0;
  double noise_floor = 0.0;
  double correlation = 0.0;
  double delay_samples = 0.0;
};

struct Sensors {
  Sensor current;
  Sensor torque;
  Sensor temperature;
  Sensor tachometer;
  bool has_tachometer = false;
  int motor_counts = 16384;
  int output_counts = 262144;
  double motor_delay_samples = 0.0;
  double output_delay_samples = 0.0;
};

/// PI velocity loop of the drive: A per rad/s and A per rad.
struct VelocityLoop {
  double proportional = 0.0;
  double integral = 0.0;
};

/// The amplifier of a drive. Zero: without that limit.
struct Amplifier {
  double saturation_a = 0.0;  ///< of a low supply; the measured current saturates as well
  double bandwidth_hz = 0.0;
  double offset_a = 0.0;  ///< flows in addition to the measured current
};

/// Lumped: one temperature of housing, gear and motor. Without a capacity the experiment states it.
struct Thermal {
  double capacity_j_c = 0.0;
  double resistance_c_w = 1.0;  ///< to the air
  double winding_ohm = 0.0;
  std::optional<double> ambient_c{};  ///< else the reference
  std::optional<double> start_c{};    ///< of the drive, otherwise that of the air
};

struct Drive {
  std::string name;
  double gear_ratio = 100.0;
  double torque_constant_nm_a = 0.0;
  double rated_current_a = 0.0;
  double rated_velocity_rad_s = 0.0;
  double rated_torque_nm = 0.0;
  double temperature_reference_c = 30.0;
  double current_limit_a = 0.0;
  double sample_s = 1e-3;
  int steps_per_sample = 16;
  /// Relative standard deviation of viscous and of Coulomb friction from record to record.
  double friction_variation = 0.0;
  Sensors sensors;
  VelocityLoop loop;
  Amplifier amplifier;
  Thermal thermal;
  std::vector<Effect> effects;
  double hidden_scale = 1.0;

  /// The present effect of this type (first of several), or nullptr.
  const Effect* find(std::string_view type) const;
  /// Label of the hidden effect, empty where nothing is hidden.
  std::string hidden() const;
};

enum class Mode { off, current, velocity };
enum class Waveform {
  zero,
  sine,
  asymmetric_sine,
  triangle,
  trapezoid,
  square,
  composite,
  saw_tooth,
  inverted_sine,
  multi_sine
};

/// One line of a multi-sine: sin of `harmonic` times the cycle's phase and `phase_turns` more.
struct Line {
  int harmonic = 1;
  double phase_turns = 0.0;
  double weight = 1.0;
};

/// One motion to record. The amplitude is in ampere (Mode::current) or motor rad/s (Mode::velocity).
struct ExperimentPlan {
  std::string name;
  Mode mode = Mode::off;
  Waveform waveform = Waveform::zero;
  double amplitude = 0.0;
  double frequency_hz = 0.0;
  double duration_s = 12.0;
  bool locked = false;
  bool holdout = false;
  double temperature_c = 30.0;      ///< at the start
  double temperature_rise_c = 0.0;  ///< until the end of the record
  double start_output_rad = 0.0;
  /// Of runs of a plan.
  double offset = 0.0;
  double end_frequency_hz = -1.0;  ///< of a linear chirp; below zero: none
  std::vector<Line> lines;         ///< of a multi-sine
  double slope_limit = 0.0;        ///< of the set point, per second; zero: none
  bool fades_out = false;
  double load_torque_nm = 0.0;  ///< on the output, positive resists
};

struct PlantFile {
  Drive drive;
  std::vector<ExperimentPlan> experiments;
};

/// Reads a plant file (hil/plant/README.md describes the format). Throws std::runtime_error with file, line and cause.
PlantFile load_plant(const std::filesystem::path& file);
/// The same from text; `origin` names it in errors.
PlantFile parse_plant(std::string_view text, std::string_view origin);
/// The drive and the experiments of the demo, which are built in.
PlantFile demo_plant();

/// The runs of a plan that `flexspline plan` wrote ("flexspline-plan/1"), for `drive`, at the plan's sample time, which
/// is set in the drive, as is a current limit that is lower than the drive's. Throws std::runtime_error with file, line
/// and cause, also for what the plant cannot do: position control.
std::vector<ExperimentPlan> load_plan(const std::filesystem::path& file, Drive& drive);

/// Makes `effect` (a type, or "torque_ripple:7" for an order) present at `scale` times its size and hides it: the base
/// model does not name it. Throws std::invalid_argument where the drive's file does not know the effect.
void hide(Drive& drive, std::string_view effect, double scale = 1.0);
/// Makes `effect` present at its size, as a part of the base model.
void with(Drive& drive, std::string_view effect);
/// Takes `effect` out of the drive.
void without(Drive& drive, std::string_view effect);

}  // namespace flexspline::plant
