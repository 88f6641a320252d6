// Checks of measurements that were read without errors. Each check adds findings and masks; none changes a value.
#pragma once

#include <span>
#include <string_view>

#include "host/input/data/dataset.hpp"
#include "host/input/data/findings.hpp"

namespace flexspline::data {

// What to do where an output that does not move is held on purpose.
inline constexpr std::string_view kStateLocked =
    "write load = \"locked\" under its [[experiment]] in dataset.toml, or give --load locked to flexspline new";

// On the samples as they are in the file, before any resampling; `segments` and `masked` must be set.

// Many samples in a row at exactly the largest or smallest current or torque: "clipping", and masked.
void check_clipping(Experiment& experiment, Findings& findings);
// Steps of a whole turn between samples: "wrapped_position"; where that is tolerated the turns are added.
void check_wrapped_positions(Experiment& experiment, Axis axis, Findings& findings);
// Positions and efforts in whole numbers only: "unit", with counts, thousandths or shares of a rated value as the
// likely ones. Once resampled they are whole numbers no longer.
void check_whole_numbers(const Experiment& experiment, Findings& findings);

// On the uniform time base.

// Velocity against the derivative of position: "velocity_position_mismatch".
void check_velocities(const Experiment& experiment, const DriveFacts& drive, Findings& findings);
// Velocity that is late against its position, as filtered ones are: "velocity_lag".
void check_velocity_lag(const Experiment& experiment, Findings& findings);
// Current or motor torque that takes energy out of the drive on its way there and back: "sign".
void check_effort_sign(const Experiment& experiment, Findings& findings);
// Output against motor position and gear ratio: "gear_ratio".
void check_gear_ratio(const Experiment& experiment, const DriveFacts& drive, Findings& findings);
// Long intervals without motion: "standstill", and masked unless the load is locked or all of it is at rest.
void check_standstill(Experiment& experiment, Findings& findings);
// "constant_column".
void check_constant_columns(const Experiment& experiment, Findings& findings);
// Values that no drive has: "unit" with the likely one.
void check_ranges(const Experiment& experiment, Axis axis, Findings& findings);

// Slope of the increments of y over those of x, over the window length in which x moves most: free of differentiation,
// insensitive to a delay and to quantisation. `meaningful` is false where x hardly moves.
struct IncrementRatio {
  double factor = 0.0;
  bool meaningful = false;
};
IncrementRatio increment_ratio(std::span<const double> y, std::span<const double> x, std::span<const Segment> segments);

// Standard deviation of white noise on a smooth signal, from second differences.
double noise_of(std::span<const double> signal, std::span<const Segment> segments);

}  // namespace flexspline::data
