// The settings of a drive (loops, limits, sensors) out of its block, as a file of settings that `pack --drive` takes:
// so that another model goes on a drive that stays otherwise as it is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/drive_link/deployment/pack.hpp"

namespace flexspline::drive {

struct KeptSettings {
  std::string text;
  std::optional<double> overcurrent_lowered_from_a;
  std::vector<std::string> warnings;  // of settings that a block does not show
};

// Throws deployment::PackError where the block holds no settings. What usually follows from the model (inertia,
// stiffness, the torque of a stuck encoder) follows from the new one, unless the block has another value than its own
// model gives. An overcurrent above `most_current_a`, which a block in other bases could not measure, is lowered to it.
KeptSettings kept_settings(const deployment::Unpacked& block, double most_current_a);

// A text for each setting that `kept_settings` took from the block `before` and that is another one in `after`; a
// lowered overcurrent is not among them.
std::vector<std::string> changed_settings(const deployment::Unpacked& before, const deployment::Unpacked& after);

}  // namespace flexspline::drive
