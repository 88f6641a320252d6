#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// The messages of USB/IP, version 1.1.1, as the Linux kernel documents them (Documentation/usb/usbip_protocol.rst). All
// numbers are big endian.
namespace flexspline::usbip {

using Buffer = std::vector<std::uint8_t>;

inline constexpr std::uint16_t kVersion = 0x0111;
inline constexpr std::size_t kOperationBytes = 8;  // version, code, status
inline constexpr std::size_t kBusIdBytes = 32;
inline constexpr std::size_t kCommandBytes = 48;

enum class Operation : std::uint16_t {
  request_import = 0x8003,
  reply_import = 0x0003,
  request_list = 0x8005,
  reply_list = 0x0005,
};
/// Of a reply to an import.
enum class ImportStatus : std::uint32_t { ok = 0, not_available = 1, busy = 2, no_device = 4 };

enum class Command : std::uint32_t { submit = 1, unlink = 2, submitted = 3, unlinked = 4 };

/// The head of SUBMIT and UNLINK.
struct CommandHead {
  std::uint32_t command = 0;
  std::uint32_t sequence = 0;
  std::uint32_t device = 0;
  std::uint32_t direction = 0;  // 1: to the host
  std::uint32_t endpoint = 0;
  // SUBMIT
  std::uint32_t flags = 0;
  std::int32_t length = 0;
  std::int32_t isochronous_packets = 0;
  std::array<std::uint8_t, 8> setup{};
  // UNLINK
  std::uint32_t unlink_sequence = 0;
};
inline constexpr std::uint32_t kShortIsAnError = 0x0001;  // URB_SHORT_NOT_OK
inline constexpr std::uint32_t kEndWithEmpty = 0x0040;    // URB_ZERO_PACKET

struct OperationHead {
  std::uint16_t version = 0;
  std::uint16_t code = 0;
  std::uint32_t status = 0;
};

OperationHead read_operation(std::span<const std::uint8_t, kOperationBytes> bytes);
/// The text of a field up to its first zero; empty where it has none.
std::string read_bus_id(std::span<const std::uint8_t, kBusIdBytes> bytes);
CommandHead read_command(std::span<const std::uint8_t, kCommandBytes> bytes);

void put8(Buffer& to, std::uint8_t value);
void put16(Buffer& to, std::uint16_t value);
void put32(Buffer& to, std::uint32_t value);
/// A field of `bytes`, filled with zeros; the last is one.
void put_text(Buffer& to, std::string_view text, std::size_t bytes);

void put_operation(Buffer& to, Operation code, std::uint32_t status);
void put_submitted(Buffer& to, std::uint32_t sequence, std::int32_t status, std::size_t actual_length);
void put_unlinked(Buffer& to, std::uint32_t sequence, std::int32_t status);

}  // namespace flexspline::usbip
