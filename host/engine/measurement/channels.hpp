// The signals of a record as what goes in and what comes out, before any model.
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::measurement {

// One signal at every sample of a record. What the sampling did to it is undone line by line in the spectrum.
struct Channel {
  std::string name;  // of its column; "torsion_rad" and velocities that are taken from a position are formed here
  std::string unit;
  std::vector<double> values;
  bool held = false;         // a command that the drive holds for a sample: later by half a sample
  bool differenced = false;  // backward difference of a position over a sample; valid from a segment's second sample

  // Variance that the stated steps of encoders add to a sample of what was differenced, else of the signal. In a motion
  // that repeats itself the steps do so, too: they are no noise from period to period, and no effect of the drive.
  double step_variance = 0.0;

  // What a line of the sampled signal is to be multiplied by to be that of the physical quantity; one at 0 Hz.
  std::complex<double> correction(double frequency_hz, double sample_s) const;
};

// Current, else motor torque; nothing where neither is measured.
std::optional<Channel> effort_of(const data::Experiment& experiment, data::Axis axis);

// What answers the effort, as far as it is measured: velocity of the motor (of its position where there is one, else
// the tachometer's; of the output where the motor has neither), torque, torsion (q / N - qo; qo is zero where a
// locked load has no sensor).
std::vector<Channel> responses_of(const data::Experiment& experiment, const data::DriveFacts& drive);

// Everything that is measured, set points excepted, and the velocity and torsion above.
std::vector<Channel> measured_channels(const data::Experiment& experiment, const data::DriveFacts& drive);

}  // namespace flexspline::measurement
