#include "hil/usbip/wire.hpp"

#include <algorithm>

namespace flexspline::usbip {
namespace {

std::uint32_t word32(std::span<const std::uint8_t> b, std::size_t at) {
  return std::uint32_t{b[at]} << 24 | std::uint32_t{b[at + 1]} << 16 | std::uint32_t{b[at + 2]} << 8 | b[at + 3];
}
void put_reply_head(Buffer& to, Command command, std::uint32_t sequence) {
  put32(to, static_cast<std::uint32_t>(command));
  put32(to, sequence);
  // Device, direction and endpoint are zero in replies.
  for (int i = 0; i < 3; ++i) put32(to, 0);
}

}  // namespace

OperationHead read_operation(std::span<const std::uint8_t, kOperationBytes> b) {
  const std::uint32_t first = word32(b, 0);
  return {static_cast<std::uint16_t>(first >> 16), static_cast<std::uint16_t>(first & 0xffff), word32(b, 4)};
}

std::string read_bus_id(std::span<const std::uint8_t, kBusIdBytes> bytes) {
  const auto end = std::find(bytes.begin(), bytes.end(), 0);
  return end == bytes.end() ? std::string() : std::string(bytes.begin(), end);
}

CommandHead read_command(std::span<const std::uint8_t, kCommandBytes> b) {
  CommandHead head;
  head.command = word32(b, 0);
  head.sequence = word32(b, 4);
  head.device = word32(b, 8);
  head.direction = word32(b, 12);
  head.endpoint = word32(b, 16);
  head.flags = word32(b, 20);
  head.unlink_sequence = head.flags;  // the same place
  head.length = static_cast<std::int32_t>(word32(b, 24));
  head.isochronous_packets = static_cast<std::int32_t>(word32(b, 32));
  std::copy_n(b.begin() + 40, head.setup.size(), head.setup.begin());
  return head;
}

void put8(Buffer& to, std::uint8_t value) {
  to.push_back(value);
}
void put16(Buffer& to, std::uint16_t value) {
  put8(to, static_cast<std::uint8_t>(value >> 8));
  put8(to, static_cast<std::uint8_t>(value & 0xff));
}
void put32(Buffer& to, std::uint32_t value) {
  put16(to, static_cast<std::uint16_t>(value >> 16));
  put16(to, static_cast<std::uint16_t>(value & 0xffff));
}
void put_text(Buffer& to, std::string_view text, std::size_t bytes) {
  const std::string_view fits = text.substr(0, bytes - 1);
  to.insert(to.end(), fits.begin(), fits.end());
  to.insert(to.end(), bytes - fits.size(), 0);
}

void put_operation(Buffer& to, Operation code, std::uint32_t status) {
  put16(to, kVersion);
  put16(to, static_cast<std::uint16_t>(code));
  put32(to, status);
}
void put_submitted(Buffer& to, std::uint32_t sequence, std::int32_t status, std::size_t actual_length) {
  put_reply_head(to, Command::submitted, sequence);
  put32(to, static_cast<std::uint32_t>(status));
  put32(to, static_cast<std::uint32_t>(actual_length));
  // Start frame, isochronous packets, errors among them, and what is not used.
  for (int i = 0; i < 5; ++i) put32(to, 0);
}
void put_unlinked(Buffer& to, std::uint32_t sequence, std::int32_t status) {
  put_reply_head(to, Command::unlinked, sequence);
  put32(to, static_cast<std::uint32_t>(status));
  for (int i = 0; i < 6; ++i) put32(to, 0);
}

}  // namespace flexspline::usbip
