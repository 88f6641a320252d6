// The note in a block that says which build of the tool made it. A drive passes it over.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace flexspline::deployment {

inline constexpr std::uint16_t kMakerNote = 0xF001;

// What this build writes: text::tool_name().
std::vector<std::uint8_t> maker_note();
// What stands in a good block; empty where it does not say.
std::string maker_of(std::span<const std::uint8_t> block);

}  // namespace flexspline::deployment
