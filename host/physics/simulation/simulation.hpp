// The model on its own: what motion and torque it predicts from the measured effort alone (free run).
#pragma once

#include <optional>
#include <stdexcept>
#include <vector>

#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::simulation {

struct Options {
  // Longest integration step; a sample is divided into equal steps of at most this length.
  double step_s = 1.0 / 16000.0;
  // The effort that acts at time t is the one measured at t - effort_shift_samples * sample_s.
  double effort_shift_samples = 0.0;
  // Velocities at the first sample of every segment, where the caller knows better than the measurement does (motor
  // side and output side, rad/s or m/s).
  std::optional<double> initial_motor_velocity;
  std::optional<double> initial_output_velocity;
};

// Each signal has the experiment's length, in its axis' units (rad or m, N m or N); samples outside the segments and
// those after a model that diverges are NaN. At a step of a held current the acceleration is the mean of both sides.
// All are empty where nothing can be simulated: locked load and no effect on the transmission balance.
struct FreeRun {
  std::vector<double> motor_position;
  std::vector<double> motor_velocity;
  std::vector<double> motor_acceleration;
  std::vector<double> output_position;
  std::vector<double> output_velocity;
  std::vector<double> torque;
  data::Column effort = data::Column::current;  // the column that drives the model
};

// A parameter that the simulation needs has no value, or the model has no moving mass; the text names what is missing.
class ModelIncomplete : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Runs the model on the measured effort (current_a * Km, or motor_torque_nm where there is no current), each segment
// from its first measured sample. Motor and output are two masses where the model has an effect on the transmission
// balance and, with a free load, output inertia; else one rigid mass with qo = q/N, and `torque` comes from the load
// balance. Where motor and output positions have no common zero (they differ by more than the gear can twist), the
// torsion starts in equilibrium instead. A missing temperature is the reference temperature, a missing load torque
// zero. Throws ModelIncomplete, and std::invalid_argument where the experiment has no effort, no time base, or a step
// of Options is not positive.
FreeRun run(const model::Model& model, const data::Experiment& experiment, const Options& options = {});

}  // namespace flexspline::simulation
