#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "hil/usbip/bus_device.hpp"

namespace flexspline::usbip {

/// The status of a transfer: Linux's error numbers, negative, as in USB/IP.
enum class Status : std::int32_t {
  ok = 0,
  no_endpoint = -2,   // ENOENT
  bad_request = -22,  // EINVAL
  stall = -32,        // EPIPE
  protocol = -71,     // EPROTO
  overflow = -75,     // EOVERFLOW: more data than requested
  unlinked = -104,    // ECONNRESET
  timed_out = -110,   // ETIMEDOUT
  too_short = -121,   // EREMOTEIO: less data, where that was not allowed
};

/// A device's descriptors, which a host reads before it uses the device.
struct DeviceInfo {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::uint16_t release = 0;
  std::array<std::uint8_t, 3> code{};  // class, subclass, protocol
  std::uint8_t configuration = 0;
  std::uint8_t configurations = 0;
  std::vector<std::array<std::uint8_t, 3>> interfaces;  // the same of each
  std::map<std::uint8_t, std::uint16_t> packet_bytes;   // of each endpoint's address
};

/// The host's side of the bus: splits transfers into packets, and joins packets to transfers.
class HostController {
 public:
  explicit HostController(BusDevice& device) : device_(device) {}

  /// Resets the bus, gives the device an address and reads its descriptors. False where it does not answer as chapter 9
  /// of USB 2.0 requires.
  bool enumerate();
  /// Without a host: the device is on the bus, without address.
  void release() { device_.reset(); }
  const DeviceInfo& info() const { return info_; }

  /// A whole control transfer. `data` is sent, or received, by the direction of `setup`.
  Status control(std::span<const std::uint8_t, 8> setup, std::vector<std::uint8_t>& data);

  enum class Step : std::uint8_t { done, later, failed };
  /// Continues a transfer from `endpoint` until it has `bytes` or a short packet was received.
  Step in(std::uint8_t endpoint, std::size_t bytes, std::vector<std::uint8_t>& data, Status& status);
  /// Continues a transfer to `endpoint`; `packets` have been sent. `end_empty` adds an empty packet after full
  /// ones.
  Step out(std::uint8_t endpoint, std::span<const std::uint8_t> data, bool end_empty, std::size_t& packets,
           Status& status);

 private:
  bool read_configuration(std::span<const std::uint8_t> bytes);
  std::size_t packet_bytes(std::uint8_t address) const;

  BusDevice& device_;
  DeviceInfo info_;
};

}  // namespace flexspline::usbip
