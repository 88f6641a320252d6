#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace flexspline::usbip {

/// A device's answer to a packet. Silence: there is no such endpoint.
enum class Handshake : std::uint8_t { ack, nak, stall, silence };

/// A full-speed USB device on its bus, packet by packet. `endpoint` is a number without direction.
class BusDevice {
 public:
  virtual ~BusDevice() = default;
  virtual void reset() = 0;
  virtual void setup(std::span<const std::uint8_t, 8> bytes) = 0;
  /// One packet to the host, at most 64 bytes; `packet` is what it was, where it was acknowledged.
  virtual Handshake in(std::uint8_t endpoint, std::vector<std::uint8_t>& packet) = 0;
  virtual Handshake out(std::uint8_t endpoint, std::span<const std::uint8_t> packet) = 0;
};

}  // namespace flexspline::usbip
