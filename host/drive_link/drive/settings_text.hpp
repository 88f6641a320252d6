// The settings of a drive (loops, limits, sensors) out of its block, as a file of settings that `pack --drive` takes:
// so that another model goes on a drive that stays otherwise as it is.
#pragma once

#include <optional>
#include <string>

#include "host/drive_link/deployment/pack.hpp"

namespace flexspline::drive {

// Throws deployment::PackError where the block holds no settings. Zeros of sensors and the torsion observer's noise are
// not in a block's description; they are what follows from the model. An overcurrent above `most_current_a`, which a
// block in other bases could not measure, is lowered to it, and `lowered_from_a` says so.
std::string settings_text(const deployment::Unpacked& block, double most_current_a,
                          std::optional<double>& lowered_from_a);

}  // namespace flexspline::drive
