#pragma once

#include "firmware/control.hpp"
#include "hil/plant/parameters.hpp"
#include "shared/control/drive_parameters_setup.hpp"

namespace flexspline::board {

/// The bases of a drive's numbers, from its ratings; a tick is the base of time.
effects::DriveConstants<double> constants_of(const plant::Drive& drive, std::uint32_t tick_hz = 20'000);

/// Loops, limits, observers and sensors that fit a drive of the class of the demo's, for numbers in the bases of `d`.
/// To be changed as one likes before parameters_of().
control::DriveSetup<double> setup_of(const plant::Drive& drive, const effects::DriveConstants<double>& d);
control::DriveSetup<double> setup_of(const plant::Drive& drive);

/// The parameters of the setup, and as the model the effects that the drive's plant has and the catalogue knows, with
/// the plant's own values. Throws std::runtime_error with the reason where numbers do not fit.
firmware::Parameters parameters_of(const plant::Drive& drive, const control::DriveSetup<double>& setup);

}  // namespace flexspline::board
