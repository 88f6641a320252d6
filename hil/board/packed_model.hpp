#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "firmware/control.hpp"
#include "shared/model/block.hpp"

namespace flexspline::board {

/// A drive's model as `flexspline pack` wrote it: coefficients as they are, in the bases of the block.
struct PackedModel {
  model::BlockHeader header;
  effects::DriveConstants<double> constants;
  model::DriveModel<firmware::N, model::EveryFormula> model;
};

/// Reads a block. Throws std::runtime_error with what is wrong with it.
PackedModel read_packed_model(std::span<const std::uint8_t> bytes);
/// The same from a file, which errors name.
PackedModel load_packed_model(const std::string& file);

}  // namespace flexspline::board
