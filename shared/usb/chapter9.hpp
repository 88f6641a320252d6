// Words of the USB 2.0 specification, chapter 9, as far as a full-speed device needs them. Numbers are those of tables
// 9-2 to 9-6.
#pragma once

#include <cstdint>
#include <span>

namespace flexspline::usb {

// Endpoint 0, and the longest packet of a full-speed bulk or interrupt endpoint.
inline constexpr std::size_t kPacketBytes = 64;

// An endpoint's address: its number, and the top bit where packets go to the host.
inline constexpr std::uint8_t kToHost = 0x80;
inline constexpr std::uint8_t kEndpointNumber = 0x0f;

enum class RequestKind : std::uint8_t { standard, of_class, vendor, reserved };
enum class Recipient : std::uint8_t { device, interface, endpoint, other };

enum class StandardRequest : std::uint8_t {
  get_status = 0,
  clear_feature = 1,
  set_feature = 3,
  set_address = 5,
  get_descriptor = 6,
  set_descriptor = 7,
  get_configuration = 8,
  set_configuration = 9,
  get_interface = 10,
  set_interface = 11,
  synch_frame = 12,
};

enum class DescriptorType : std::uint8_t {
  device = 1,
  configuration = 2,
  string = 3,
  interface = 4,
  endpoint = 5,
};

enum class TransferType : std::uint8_t { control, isochronous, bulk, interrupt };

// Of SET_FEATURE and CLEAR_FEATURE, to an endpoint.
inline constexpr std::uint16_t kEndpointHalt = 0;
// To the device (table 9-6), and where its state is reported (figure 9-4, table 9-10).
inline constexpr std::uint16_t kDeviceRemoteWakeup = 1;
inline constexpr std::uint8_t kStatusRemoteWakeup = 0x02;
inline constexpr std::uint8_t kAttributeRemoteWakeup = 0x20;

// The eight bytes at the start of every control transfer.
struct Setup {
  std::uint8_t type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;

  static constexpr std::size_t kBytes = 8;
  static constexpr Setup of(std::span<const std::uint8_t, kBytes> b) {
    const auto word = [&](std::size_t i) { return static_cast<std::uint16_t>(b[i] | (b[i + 1] << 8)); };
    return {b[0], b[1], word(2), word(4), word(6)};
  }
  constexpr bool to_host() const { return (type & kToHost) != 0; }
  constexpr RequestKind kind() const { return static_cast<RequestKind>((type >> 5) & 3); }
  // Values from 4 on are reserved.
  constexpr Recipient recipient() const {
    const auto number = static_cast<std::uint8_t>(type & 0x1f);
    return number < 3 ? static_cast<Recipient>(number) : Recipient::other;
  }
  constexpr std::uint8_t value_high() const { return static_cast<std::uint8_t>(value >> 8); }
  constexpr std::uint8_t value_low() const { return static_cast<std::uint8_t>(value & 0xff); }
};

// The result of a request. Refused: the host gets STALL, which ends with its next request.
struct Reply {
  bool accepted = false;
  std::span<const std::uint8_t> data{};  // of a request to the host; has to live until the transfer ends
};
inline constexpr Reply kRefused{};
constexpr Reply reply_with(std::span<const std::uint8_t> data) {
  return {true, data};
}

}  // namespace flexspline::usb
