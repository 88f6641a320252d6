#pragma once

#include "firmware/control.hpp"
#include "hil/plant/parameters.hpp"
#include "shared/control/drive_parameters_setup.hpp"

namespace flexspline::board {

/// The bases of a drive's numbers, from its ratings; a tick is the base of time.
effects::DriveConstants<double> constants_of(const plant::Drive& drive, std::uint32_t tick_hz = 20'000);

/// Loops, limits, observers and sensors that fit a drive of the class of the demo's, for numbers in the bases of `d`.
/// The caller may change it before parameters_of().
control::DriveSetup<double> setup_of(const plant::Drive& drive, const effects::DriveConstants<double>& d);
control::DriveSetup<double> setup_of(const plant::Drive& drive);

/// The parameters of the setup. The model has the effects of the drive's plant that are in the catalogue, with the
/// plant's own values. Throws std::runtime_error with the reason where numbers do not fit.
firmware::Parameters parameters_of(const plant::Drive& drive, const control::DriveSetup<double>& setup);

}  // namespace flexspline::board
