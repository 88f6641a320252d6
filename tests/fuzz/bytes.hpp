// A fuzzer's input, taken from the front; zeros where it has ended.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace flexspline::tests {

class FuzzBytes {
 public:
  FuzzBytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  bool empty() const { return left_ == 0; }
  std::uint8_t next() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  std::uint16_t word() {
    const std::uint8_t low = next();
    return static_cast<std::uint16_t>(low | (next() << 8));
  }
  std::vector<std::uint8_t> some(std::size_t most) {
    const std::size_t n = std::min(most, left_);
    std::vector<std::uint8_t> bytes(data_, data_ + n);
    data_ += n;
    left_ -= n;
    return bytes;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

}  // namespace flexspline::tests
