// Numbers and texts from bytes, the least significant byte first, never beyond their end.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace flexspline::data {

// The file states something that its bytes do not contain.
class DamagedFile : public std::runtime_error {
 public:
  DamagedFile() : std::runtime_error("is damaged or cut short") {}
};

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  bool at_end() const { return at_ == bytes_.size(); }
  std::size_t left() const { return bytes_.size() - at_; }
  std::size_t position() const { return at_; }
  std::string_view take(std::uint64_t size) {
    if (size > left()) throw DamagedFile();
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }
  // To a multiple of `size` from the beginning.
  void align(std::size_t size) { take((size - at_ % size) % size); }

  // As the machine holds it; all that this runs on have the least significant byte first.
  template <class T>
  T number() {
    T value;
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }
  std::uint8_t u8() { return number<std::uint8_t>(); }
  std::uint32_t u32() { return number<std::uint32_t>(); }
  std::uint64_t u64() { return number<std::uint64_t>(); }
  // Seven bits a byte, with the highest set where more follow.
  std::uint64_t varuint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint8_t byte = u8();
      value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
      if (byte < 0x80) return value;
    }
    throw DamagedFile();
  }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

}  // namespace flexspline::data
