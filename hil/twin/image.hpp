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

struct TwinImage {
  boot::Version version = kFactoryVersion;
  std::size_t bytes = 24'000;  ///< after its header, at least 64
  bool hangs = false;          ///< it hangs at once
  bool is_signed = true;       ///< with the development key
  std::uint16_t security_counter = 0;
};
/// A firmware image for the twin. Its application is this program's own; the image states its version, and whether it
/// runs or hangs.
std::vector<std::uint8_t> twin_image(const TwinImage& what);

/// Signs an image with the development key, whatever its board. It has to be whole.
void sign_with_development_key(std::vector<std::uint8_t>& image);

/// Whether the twin can run the bytes after an image's header. Other contents hang, like code for another board.
bool runs_on_twin(std::span<const std::uint8_t> payload);

}  // namespace flexspline::twin
