#pragma once

#include <cstdint>
#include <vector>

#include "hil/plant/parameters.hpp"
#include "shared/control/drive_parameters_setup.hpp"

namespace flexspline::twin {

/// The factory parameter block of a drive: its sensors, loops and limits, and the plant's effects that are not hidden,
/// with the plant's own values, in the bases of its ratings.
std::vector<std::uint8_t> factory_block(const plant::Drive& drive);
/// The same with other settings.
std::vector<std::uint8_t> factory_block(const plant::Drive& drive, const control::DriveSetup<double>& setup);

}  // namespace flexspline::twin
