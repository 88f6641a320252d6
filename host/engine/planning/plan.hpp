// A plan: motions for a drive to make while it is recorded, and what a person does to the drive before each. The file
// is described in README.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace flexspline::planning {

// What the set point is: a current of the motor, or its velocity, or its position. `off`: the drive's power is off.
enum class Mode : std::uint8_t { off, current, velocity, position };
// Shapes and signals of shared/control, by their names there. `zero` holds the offset.
enum class Waveform : std::uint8_t {
  zero,
  sine,
  inverted_sine,
  composite,
  multi_sine,
  asymmetric_sine,
  square,
  saw_tooth,
  triangle,
};
std::string_view name_of(Mode mode);
std::string_view name_of(Waveform waveform);

struct Line {
  int harmonic = 1;
  double phase_turns = 0.0;
  double weight = 1.0;
};

// One recording. Set points are A, rad/s or rad at the motor (m/s or m on a linear axis).
struct Run {
  std::string name;
  Mode mode = Mode::velocity;
  Waveform waveform = Waveform::sine;
  double amplitude = 0.0;
  double offset = 0.0;
  double frequency_hz = 0.0;
  std::optional<double> end_frequency_hz;  // of a linear chirp
  std::vector<Line> lines;                 // of a multi-sine
  std::optional<double> slope_limit;       // of the set point, per second
  double duration_s = 10.0;
  bool locked = false;
  double load_torque_nm = 0.0;  // applied to the output from outside, positive resists
  std::optional<double> temperature_c;
  std::string instructions;  // for the person at the drive; empty: none
};

// What must not be exceeded, whatever is planned.
struct Limits {
  double current_a = 0.0;       // of the motor
  double velocity_rad_s = 0.0;  // of the motor
  double travel_rad = 0.0;      // of the output, from end to end
  double duration_s = 0.0;      // of all runs together
  double load_torque_nm = 0.0;  // that a person can apply from outside
};

struct Plan {
  std::string model;                  // its name
  std::vector<std::string> separate;  // two effects, or none
  double sample_s = 1e-3;
  Limits limits;
  std::vector<std::string> notes;  // what is expected of it, for a reader
  std::vector<Run> runs;
};

// Of a plan file: file, line, what is wrong, what to do.
class PlanError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The set points are faded in and out over this time at most: 3 x^2 - 2 x^3.
inline constexpr double kFade_s = 0.25;

std::string text_of(const Plan& plan);
// Throws PlanError. `origin` is the file's name, for messages.
Plan parse(const std::string& text, std::string_view origin);
Plan read(const std::filesystem::path& file);

// The set point at each sample. The drive's own excitation in double: shared/control/excitation.hpp. Throws PlanError
// for a run that it cannot make.
std::vector<double> set_points(const Run& run, double sample_s);

}  // namespace flexspline::planning
