// A serial line, 8N1. The control tick moves one byte each way, so that no second interrupt is needed (RM0090, 30).
// Up to 115200 baud nothing is lost while background work is busy for less than 11 ms, which fill the ring; a host
// repeats what a check of a signature or an erase took longer for.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

// A ring with one writing and one reading context.
template <std::size_t size>
class ByteRing {
  static_assert(size <= 256 && (size & (size - 1)) == 0);

 public:
  std::size_t room() const { return size - used(); }
  bool put(std::uint8_t byte) {
    if (room() == 0) return false;
    const std::uint32_t at = put_.load(std::memory_order_relaxed);
    bytes_[at % size] = byte;
    put_.store(at + 1, std::memory_order_release);
    return true;
  }
  bool take(std::uint8_t& byte) {
    if (used() == 0) return false;
    const std::uint32_t at = taken_.load(std::memory_order_relaxed);
    byte = bytes_[at % size];
    taken_.store(at + 1, std::memory_order_release);
    return true;
  }

 private:
  std::size_t used() const { return put_.load(std::memory_order_acquire) - taken_.load(std::memory_order_acquire); }

  std::array<std::uint8_t, size> bytes_{};
  std::atomic<std::uint32_t> put_{0};
  std::atomic<std::uint32_t> taken_{0};
};

template <std::uint32_t usart>
class Usart {
 public:
  // `bus_hz`: of APB1.
  void start(std::uint32_t bus_hz, std::uint32_t baud) {
    switch_clock_on(usart);
    hardware(usart + kBaud) = (bus_hz + baud / 2) / baud;  // sixteenths of a bit's sixteen samples
    hardware(usart + kControl1) = (1U << 13) | (1U << 3) | (1U << 2);
  }
  // The tick.
  void move() {
    const std::uint32_t status = hardware(usart);
    // Reading the data ends an overrun as well. The frame's CRC finds corrupted bytes. A full ring drops.
    if ((status & (kCame | kOverrun)) != 0) came_.put(static_cast<std::uint8_t>(hardware(usart + kData)));
    std::uint8_t byte = 0;
    if ((status & kCanSend) != 0 && to_send_.take(byte)) hardware(usart + kData) = byte;
  }
  // Background work.
  bool receive(std::uint8_t& byte) { return came_.take(byte); }
  std::size_t room() const { return to_send_.room(); }
  void send(std::uint8_t byte) { to_send_.put(byte); }

 private:
  static constexpr std::uint32_t kData = 0x04, kBaud = 0x08, kControl1 = 0x0C;
  static constexpr std::uint32_t kOverrun = 1U << 3, kCame = 1U << 5, kCanSend = 1U << 7;

  ByteRing<128> came_{};
  ByteRing<256> to_send_{};
};

}  // namespace flexspline::stm32f4
