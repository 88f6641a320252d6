// The report's experiments with the parameters of the report's own rows, as drives and motions of the plant.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hil/plant/parameters.hpp"
#include "hil/plant/recorder.hpp"

namespace flexspline::rhs100 {

/// One experiment with its own drive, as each row of a table has its own parameters.
struct Experiment {
  plant::Drive drive;
  plant::ExperimentPlan plan;
};

/// Which columns are written.
enum class Sensors {
  drive,  ///< current, encoder and tachometer of the motor, encoder of the output, torque through the flexspline
  motor,  ///< current and tachometer of a motor without gear
};

/// Experiments of one table, which are identified together.
struct Set {
  std::string name;   ///< "table-7"; its folder
  std::string title;  ///< its description, one line
  Sensors sensors = Sensors::drive;
  double gear_ratio = 100.0;
  std::optional<double> load_torque_nm;  ///< known, constant, on the shaft of a motor
  std::vector<Experiment> experiments;
  std::string base_model;  ///< text of the model to identify, without the values to estimate
};

/// Values that the report does not give; the README in the data set explains each choice.
inline constexpr double kOutputInertia = 0.06;     ///< kg m^2
inline constexpr double kOutputViscous = 0.5;      ///< N m s/rad
inline constexpr double kOutputCoulomb = 0.6;      ///< N m
inline constexpr double kFullVelocity = 130.0;     ///< motor rad/s at 100 % in velocity mode
inline constexpr double kFullLockedCurrent = 5.0;  ///< A at 100 % with the output locked
inline constexpr double kFullSlowCurrent = 7.0;    ///< A at 100 % in current mode with the output free
inline constexpr int kMotorCounts = 16384;
inline constexpr int kOutputCounts = 262144;
inline constexpr double kSimulationLoad = 0.05;  ///< N m, the constant load of section 3.4 with the composite
inline constexpr double kSlowSimulationLoad =
    0.005;  ///< with the saw-tooth: both directions break away in the same way

/// Tables 4 (with the other seven of the eleven experiments of section 4.2.2 as hold-out), 6, 7 and 8.
Set table_4();
Set table_6();
Set table_7();
Set table_8();
/// The bare motor of tables 2 and 3: four wave forms, and four slow saw-teeth.
Set table_3_fast();
Set table_3_slow();
/// The simulation check of section 3.4: a composite of three harmonics, and a slow saw-tooth.
Set table_1_composite();
Set table_1_saw_tooth();

std::vector<Set> all_sets();

/// Records an experiment of a set; `seed`, the set's name and the experiment's place determine its noise, so that a set
/// is the same alone and among others.
plant::Record record(const Set& set, std::size_t experiment, std::uint64_t seed);

}  // namespace flexspline::rhs100
