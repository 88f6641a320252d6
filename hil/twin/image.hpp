#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "shared/boot/image.hpp"

namespace flexspline::twin {

/// What images for the twin are made for, and what its application says it runs on.
inline constexpr std::string_view kBoardName = "twin";
inline constexpr boot::Version kFactoryVersion{0, 1};

/// A firmware image for the twin. Its application is this program's own; the image says of which version it is, and
/// whether it does well or hangs at once. `payload_bytes`: how long it is behind its header, at least 64.
std::vector<std::uint8_t> twin_image(boot::Version version, std::size_t payload_bytes, bool hangs);

/// Whether the twin can run what stands behind an image's header. Anything else hangs, as foreign code does.
bool runs_on_twin(std::span<const std::uint8_t> payload);

}  // namespace flexspline::twin
