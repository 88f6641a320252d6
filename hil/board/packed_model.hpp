#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hil/board/controller.hpp"
#include "shared/model/block.hpp"

namespace flexspline::board {

/// A block that `flexspline pack --drive` wrote: its bytes for the drive, and its constants for the host.
struct PackedModel {
  std::vector<std::uint8_t> bytes;
  effects::DriveConstants<double> constants;
};

/// Reads a block like a drive with `tick_hz` ticks a second. Throws std::runtime_error with the reason.
PackedModel read_packed_model(std::span<const std::uint8_t> bytes, std::uint32_t tick_hz = SoftwareBoard::kTickHz);
/// The same from a file; errors have its name.
PackedModel load_packed_model(const std::string& file, std::uint32_t tick_hz = SoftwareBoard::kTickHz);

}  // namespace flexspline::board
