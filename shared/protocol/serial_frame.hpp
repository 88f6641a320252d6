// Messages over a serial line: the message's used bytes and their CRC-32, stuffed by COBS (Cheshire and Baker, 1999) so
// that none of them is zero, then a zero. After lost or corrupted bytes the next zero starts a new frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/protocol/message.hpp"

namespace flexspline::protocol {

inline constexpr std::size_t kSerialCrc = 4;
inline constexpr std::size_t kMostSerial = kReportBytes + kSerialCrc + 2;  // a code byte before, the zero after

struct SerialFrame {
  std::array<std::uint8_t, kMostSerial> bytes{};
  std::size_t size = 0;
  constexpr std::span<const std::uint8_t> content() const { return std::span(bytes).first(size); }
};

constexpr SerialFrame serial_frame(const Message& m) {
  std::array<std::uint8_t, kReportBytes + kSerialCrc> plain{};
  const Report report = encode(m);
  const std::size_t used = m.size();
  for (std::size_t i = 0; i < used; ++i) plain[i] = report[i];
  model::Writer crc(std::span<std::uint8_t>(plain).subspan(used, kSerialCrc));
  crc.put(model::crc32(std::span(plain).first(used)));
  SerialFrame frame;
  std::size_t code_at = 0, at = 1;
  for (std::size_t i = 0; i < used + kSerialCrc; ++i) {
    if (plain[i] == 0) {
      frame.bytes[code_at] = static_cast<std::uint8_t>(at - code_at);
      code_at = at++;
    } else {
      frame.bytes[at++] = plain[i];
    }
  }
  frame.bytes[code_at] = static_cast<std::uint8_t>(at - code_at);
  frame.bytes[at++] = 0;
  frame.size = at;
  return frame;
}

// Takes bytes as they arrive.
class SerialReader {
 public:
  // True: `m` is a complete message.
  constexpr bool take(std::uint8_t byte, Message& m) {
    if (byte != 0) {
      if (size_ < frame_.size()) frame_[size_] = byte;
      if (size_ <= frame_.size()) ++size_;
      return false;
    }
    const std::size_t size = size_;
    size_ = 0;
    if (size == 0) return false;  // zeros between frames are no fault
    const bool good = size <= frame_.size() && unstuff(std::span(frame_).first(size), m);
    if (!good) ++damaged_;
    return good;
  }
  // The number of invalid frames so far.
  constexpr std::uint32_t damaged() const { return damaged_; }
  constexpr void restart() { size_ = 0; }

 private:
  static constexpr bool unstuff(std::span<const std::uint8_t> stuffed, Message& m) {
    std::array<std::uint8_t, kReportBytes + kSerialCrc> plain{};
    std::size_t size = 0;
    for (std::size_t i = 0; i < stuffed.size();) {
      const std::size_t end = i + stuffed[i];
      if (end > stuffed.size()) return false;
      for (++i; i < end; ++i) {
        if (size == plain.size()) return false;
        plain[size++] = stuffed[i];
      }
      if (end == stuffed.size()) break;
      if (size == plain.size()) return false;
      plain[size++] = 0;
    }
    if (size < kHeadBytes + kSerialCrc) return false;
    const std::size_t used = size - kSerialCrc;
    model::Reader crc(std::span<const std::uint8_t>(plain).subspan(used, kSerialCrc));
    if (crc.take<std::uint32_t>() != model::crc32(std::span(plain).first(used))) return false;
    return decode(std::span(plain).first(used), m) && m.size() == used;
  }

  std::array<std::uint8_t, kMostSerial - 1> frame_{};
  std::size_t size_ = 0;
  std::uint32_t damaged_ = 0;
};

}  // namespace flexspline::protocol
