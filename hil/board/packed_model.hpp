#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hil/board/brain.hpp"
#include "shared/model/block.hpp"

namespace flexspline::board {

/// A block that `flexspline pack --drive` wrote: what the drive is given, byte for byte, and what its host has to know.
struct PackedModel {
  std::vector<std::uint8_t> bytes;
  effects::DriveConstants<double> constants;
};

/// Reads a block as a drive does that ticks `tick_hz` times a second. Throws std::runtime_error with what is wrong.
PackedModel read_packed_model(std::span<const std::uint8_t> bytes, std::uint32_t tick_hz = SoftwareBoard::kTickHz);
/// The same from a file, which errors name.
PackedModel load_packed_model(const std::string& file, std::uint32_t tick_hz = SoftwareBoard::kTickHz);

}  // namespace flexspline::board
