// The note in a block with the build of the tool that wrote it. A drive ignores it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace flexspline::deployment {

inline constexpr std::uint16_t kMakerNote = 0xF001;

// What this build writes: text::tool_name().
std::vector<std::uint8_t> maker_note();
// The contents of a valid block; empty where it does not state them.
std::string maker_of(std::span<const std::uint8_t> block);

}  // namespace flexspline::deployment
