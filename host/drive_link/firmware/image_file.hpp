// Firmware images as files: read with every reason to refuse one, made of what a linker left.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "shared/boot/image.hpp"

namespace flexspline::firmware_files {

using Bytes = std::vector<std::uint8_t>;

// What is wrong with a file: which, what, what to do.
class ImageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Image {
  Bytes bytes;  // header and all, without a suffix
  boot::ImageHeader header;
  std::string board() const { return std::string(header.board_name()); }
};

// A file of flexspline image, with or without a suffix for dfu-util. Throws ImageError.
Image load_image(const std::filesystem::path& path);
// The same of bytes; `origin` names them in messages.
Image parse_image(Bytes bytes, const std::string& origin);

// Puts the header before a program that was linked to start behind one. Throws ImageError for an empty program and a
// name of no or more than fifteen letters.
Bytes make_image(const Bytes& program, const std::string& board, boot::Version version);
// DFU 1.1, appendix B: sixteen bytes behind a file that say which devices it is for.
Bytes with_dfu_suffix(Bytes image);

std::string text_of(boot::Version version);
// "1.2", as two numbers of 0 to 255. Throws ImageError.
boot::Version version_of(const std::string& text);

}  // namespace flexspline::firmware_files
