// Bytes of a parameter block: little-endian, fixed width. The fields of a row: rows.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace flexspline::model {

// CRC-32 as in IEEE 802.3 (reflected, 0xEDB88320), by half-bytes: a table of 64 bytes.
constexpr std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  constexpr std::uint32_t kTable[16] = {0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4,
                                        0x4DB26158, 0x5005713C, 0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C,
                                        0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C};
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) {
    crc = kTable[(crc ^ byte) & 15] ^ (crc >> 4);
    crc = kTable[(crc ^ (byte >> 4)) & 15] ^ (crc >> 4);
  }
  return ~crc;
}

// Writes as far as there is room and counts all bytes.
class Writer {
 public:
  explicit constexpr Writer(std::span<std::uint8_t> room) : room_(room) {}
  template <class T>
  constexpr void put(T number) {
    auto bits = static_cast<std::uint64_t>(number);
    for (std::size_t i = 0; i < sizeof(T); ++i, bits >>= 8) {
      if (at_ < room_.size()) room_[at_] = static_cast<std::uint8_t>(bits);
      ++at_;
    }
  }
  constexpr std::size_t size() const { return at_; }
  constexpr bool fits() const { return at_ <= room_.size(); }

 private:
  std::span<std::uint8_t> room_;
  std::size_t at_ = 0;
};

// Reads zeros beyond the end; whole() is false from then on.
class Reader {
 public:
  explicit constexpr Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  template <class T>
  constexpr T take() {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i, ++at_)
      if (at_ < bytes_.size()) bits |= std::uint64_t{bytes_[at_]} << (8 * i);
    return static_cast<T>(bits);
  }
  constexpr void skip(std::size_t bytes) { at_ += bytes; }
  constexpr std::size_t left() const { return at_ < bytes_.size() ? bytes_.size() - at_ : 0; }
  constexpr bool whole() const { return at_ <= bytes_.size(); }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

// A number of any size, which the drive does not compute with: mantissa 2^(exponent - 30).
struct Number {
  std::int32_t mantissa = 0;
  std::int32_t exponent = 0;
};

constexpr void put(Writer& w, const Number& x) {
  w.put(x.mantissa);
  w.put(x.exponent);
}

}  // namespace flexspline::model
