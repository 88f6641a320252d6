#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "shared/boot/image.hpp"

namespace flexspline::twin {

/// The board of images for the twin, which its application reports as well.
inline constexpr std::string_view kBoardName = "twin";
inline constexpr boot::Version kFactoryVersion{0, 1};

/// A firmware image for the twin. Its application is this program's own; the image states its version, and whether it
/// runs or hangs at once. `payload_bytes`: its length after the header, at least 64.
std::vector<std::uint8_t> twin_image(boot::Version version, std::size_t payload_bytes, bool hangs);

/// Whether the twin can run the bytes after an image's header. Other contents hang, like code for another board.
bool runs_on_twin(std::span<const std::uint8_t> payload);

}  // namespace flexspline::twin
