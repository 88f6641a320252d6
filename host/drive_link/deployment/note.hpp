// The note that the host leaves in a block: what the coefficients were derived from. A drive ignores it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/drive_link/deployment/fixed_point_check.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::deployment {

struct Note {
  model::Drive drive;
  std::vector<EffectValues> effects;
};
std::vector<std::uint8_t> note_of(const model::Drive& drive, const std::vector<EffectValues>& effects);
// Throws PackError where it is no note of ours.
Note read_note(std::span<const std::uint8_t> bytes);

}  // namespace flexspline::deployment
