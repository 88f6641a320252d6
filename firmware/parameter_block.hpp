// The interface through which a drive gets its parameters: a packed block (shared/model/block.hpp). It is checked as a
// whole and in place, in flash or in memory; nothing is written before it is found valid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/control.hpp"
#include "shared/control/drive_block.hpp"

namespace flexspline::firmware {

// Why a block is refused; model::text_of (shared/model/block_texts.hpp) has the texts.
using BlockFinding = model::BlockFault;

namespace detail {
inline std::span<const std::uint8_t> octets(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}
}  // namespace detail

// Whether a drive of this tick rate and board can take these bytes: BlockFinding::none, or the first reason why not.
// The span is the block to its last byte; block_bytes() returns that length for a block in a larger page.
inline BlockFinding check_block(std::span<const std::byte> block, std::uint32_t tick_hz,
                                const control::Hardware& hardware = {},
                                control::MotorCheck motor = control::kChecksMotor) {
  return control::check_for_drive(detail::octets(block), tick_hz, hardware, motor).fault;
}
// The length of the block at the start of a page, as it states it; zero where none begins there or it exceeds the page.
inline std::size_t block_bytes(std::span<const std::byte> page) {
  const std::size_t bytes = model::stated_bytes(detail::octets(page));
  return bytes <= page.size() ? bytes : 0;
}
// Parameters from a block that check_block() found valid.
inline void load_block(std::span<const std::byte> block, Parameters& parameters) {
  control::load_for_drive(detail::octets(block), parameters);
}

}  // namespace flexspline::firmware
