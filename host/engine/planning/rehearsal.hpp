// Simulates a run with the model: the expected recording, before the drive moves.
#pragma once

#include "host/engine/planning/plan.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::planning {

// What a recording will hold.
struct Sensors {
  bool current = true;  // else the motor's torque (or force)
  bool output_position = true;
  bool torque = true;
  bool temperature = true;
  double motor_counts = 16384;    // per turn; zero: no resolution to speak of
  double output_counts = 262144;  // per turn
};

struct Rehearsal {
  data::Experiment experiment;
  double peak_current_a = 0.0;
  double peak_velocity_rad_s = 0.0;  // motor
  double travel_rad = 0.0;           // output, from end to end
  double clipped_share = 0.0;        // share of the samples in which the velocity loop demanded more than the limit
  bool diverged = false;
};

// Simulates a run from standstill at zero, without noise but with the encoders' steps. The model must have all
// values: simulation::ModelIncomplete. Velocities are controlled by a PI loop whose bandwidth follows from the sample
// time and the model's inertia.
Rehearsal rehearse(const model::Model& model, const Run& run, double sample_s, const Limits& limits,
                   const Sensors& sensors);

}  // namespace flexspline::planning
