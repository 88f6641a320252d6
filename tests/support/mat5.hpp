// MAT files of version 5, written byte by byte from MATLAB's document "MAT-File Format", chapter 1: by another writer
// than the library that the tool reads with.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace flexspline::tests {

class Mat5Text {
 public:
  explicit Mat5Text(bool big_endian = false) : big_endian_(big_endian), text_(124, ' ') {
    word(big_endian ? 0x01004D49 : 0x4D490100);  // version 1, and "MI" as the machine writes it
  }

  // A standing vector of doubles; the name is of eight letters, so that nothing has to be padded.
  Mat5Text& add(const std::string& name, const std::vector<double>& values) {
    const std::uint32_t count = static_cast<std::uint32_t>(values.size()), bytes = 8 * count;
    for (const std::uint32_t w :
         {kMatrix, 16 + 16 + 16 + 8 + bytes, kUint32, 8u, kDoubleClass, 0u, kInt32, 8u, count, 1u, kInt8, 8u})
      word(w);
    text_ += name;
    word(kDouble);
    word(bytes);
    for (const double value : values) {
      const std::uint64_t bits = std::bit_cast<std::uint64_t>(value);
      const std::uint32_t high = static_cast<std::uint32_t>(bits >> 32), low = static_cast<std::uint32_t>(bits);
      word(big_endian_ ? high : low);
      word(big_endian_ ? low : high);
    }
    return *this;
  }

  const std::string& text() const { return text_; }

 private:
  static constexpr std::uint32_t kInt8 = 1, kInt32 = 5, kUint32 = 6, kDouble = 9, kMatrix = 14, kDoubleClass = 6;

  void word(std::uint32_t value) {
    for (int byte = 0; byte < 4; ++byte)
      text_ += static_cast<char>(value >> (big_endian_ ? 24 - 8 * byte : 8 * byte) & 0xFF);
  }

  bool big_endian_;
  std::string text_;
};

}  // namespace flexspline::tests
