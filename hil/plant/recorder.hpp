#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hil/plant/parameters.hpp"

namespace flexspline::plant {

/// One recorded experiment. All columns have one value per sample; sample k is taken at k sample times, and its current
/// is the one that the drive holds from there to sample k + 1.
struct Record {
  std::string name;
  bool locked = false;
  bool holdout = false;
  std::uint64_t seed = 0;

  std::vector<double> time_s;
  std::vector<double> current_a;
  std::vector<double> motor_position_rad;
  std::vector<double> output_position_rad;
  std::vector<double> torque_nm;
  std::vector<double> temperature_c;
  std::vector<double> load_torque_nm;        ///< external; empty where there was none
  std::vector<double> motor_velocity_rad_s;  ///< the tachometer's; empty where there is none
  std::vector<double> command;               ///< set point: motor rad/s in velocity mode, else A
  bool velocity_mode = false;

  double current_noise_std = 0.0;
  double torque_noise_std = 0.0;
  double temperature_noise_std = 0.0;
  double tachometer_noise_std = 0.0;
  double motor_position_noise_std = 0.0;  ///< of the rounding to counts
  double output_position_noise_std = 0.0;

  /// Factors of this run on viscous and on Coulomb friction.
  double viscous_factor = 1.0;
  double coulomb_factor = 1.0;

  /// True values, for tests: never written to the data files. The current is the true one, without the
  /// sensor's offset; the acceleration is that just after the sample, with the new current.
  struct Truth {
    std::vector<double> current_a;
    std::vector<double> motor_position_rad;
    std::vector<double> motor_velocity_rad_s;
    std::vector<double> motor_acceleration_rad_s2;
    std::vector<double> output_position_rad;
    std::vector<double> output_velocity_rad_s;
    std::vector<double> torque_nm;
    std::vector<double> temperature_c;
  } truth;
};

/// Records one experiment; `index` is its place in the list and picks its noise. Throws std::invalid_argument for a
/// drive that cannot be simulated, std::runtime_error where the simulation fails.
Record record_one(const Drive& drive, const ExperimentPlan& plan, std::uint64_t seed, std::uint64_t index);

/// Records all experiments in order. The same drive, plans and seed give the same bits.
std::vector<Record> record_all(const Drive& drive, const std::vector<ExperimentPlan>& plans, std::uint64_t seed);

/// Writes one CSV per record, dataset.toml, base-model.toml (without the hidden effect and without values) and
/// truth.toml (everything) into `folder`, which is made where it is missing. Each file is written completely or not at
/// all. Throws std::runtime_error naming the file that could not be written.
void write_dataset(const std::vector<Record>& records, const Drive& drive, const std::filesystem::path& folder);

/// The drive as a model file, with the true values of its effects; without the hidden one unless `with_hidden`.
std::string model_text(const Drive& drive, bool with_hidden);

}  // namespace flexspline::plant
