// Where a record begins: positions and velocities at the first sample of a segment.
#pragma once

#include <optional>

#include "host/input/data/dataset.hpp"

namespace flexspline::simulation {

struct InitialMotion {
  double position = 0.0;
  double velocity = 0.0;
};

// From a position and a velocity column, either of which may be missing; nothing where both are. With both, the
// velocity is the more certain one of the measured sample and the slope of a parabola through the first 20 ms (at least
// 8 samples) of the position, compared with the stated noise, else by the scatter of the data.
std::optional<InitialMotion> initial_motion(const data::Experiment& experiment, const data::Segment& segment,
                                            data::Column position, data::Column velocity);

}  // namespace flexspline::simulation
