// The data as the model alone would have made them: the measured effort, and the motion and torque of its free run.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/physics/simulation/simulation.hpp"

namespace flexspline::estimation {

// The model of an identification with the values of its terms.
model::Model model_with_values(const Identification& identification);

// Every record again, with motion and torque of the free run, prepared by the same pipeline with the same samples. A
// record that cannot be simulated or diverges keeps what was measured and is not marked. Records run on all cores; the
// result does not depend on their number.
struct FreeMotion {
  std::vector<data::Experiment> experiments;
  PreparedData prepared;
  std::vector<std::uint8_t> simulated;  // by record
};
struct FreeMotionOptions {
  // Initial motor velocities by record, where the caller knows better than the first sample does; else empty.
  std::span<const std::optional<double>> initial_velocity{};
  // Requested records, by record; the others stay empty. All where this is empty.
  std::span<const std::uint8_t> only{};
  double step_s = simulation::Options{}.step_s;  // longest integration step
};
FreeMotion free_motion(const Identification& identification, const FreeMotionOptions& options = {});

}  // namespace flexspline::estimation
