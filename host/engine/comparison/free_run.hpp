// A free run and the measurement, signal by signal.
#pragma once

#include <string>
#include <vector>

#include "host/engine/estimation/record.hpp"
#include "host/physics/simulation/simulation.hpp"

namespace flexspline::comparison {

struct FreeRunSignal {
  std::string name;  // motor_velocity, motor_position, output_position, torque
  data::Column column = data::Column::motor_velocity;
  std::vector<double> measured, simulated;  // one entry a sample of the experiment
};

// The signals that both the record and `run` have, in the order above. The measured velocity is filtered; the model's
// likewise, or reversals would differ for that alone. A locked output has no position to compare. Empty where nothing
// was simulated.
std::vector<FreeRunSignal> free_run_signals(const estimation::PreparedData& prepared, std::size_t record,
                                            simulation::FreeRun run);

}  // namespace flexspline::comparison
