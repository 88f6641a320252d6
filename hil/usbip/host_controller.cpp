#include "hil/usbip/host_controller.hpp"

#include <algorithm>
#include <utility>

namespace flexspline::usbip {
namespace {

constexpr std::size_t kControlPacket = 64;
constexpr std::uint8_t kToHost = 0x80;
constexpr std::uint8_t kDescriptorDevice = 1, kDescriptorConfiguration = 2, kDescriptorInterface = 4,
                       kDescriptorEndpoint = 5;
constexpr std::uint8_t kSetAddress = 5, kGetDescriptor = 6;

Status status_of(Handshake hand) {
  switch (hand) {
    case Handshake::ack:
      return Status::ok;
    case Handshake::nak:
      return Status::timed_out;
    case Handshake::stall:
      return Status::stall;
    case Handshake::silence:
      break;
  }
  return Status::protocol;
}
std::uint16_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | (bytes[at + 1] << 8));
}
std::array<std::uint8_t, 8> get_descriptor(std::uint8_t type, std::size_t length) {
  return {kToHost,
          kGetDescriptor,
          0,
          type,
          0,
          0,
          static_cast<std::uint8_t>(length & 0xff),
          static_cast<std::uint8_t>(length >> 8)};
}

}  // namespace

bool HostController::enumerate() {
  info_ = {};
  device_.reset();
  std::vector<std::uint8_t> data;
  const std::array<std::uint8_t, 8> set_address{0, kSetAddress, 1, 0, 0, 0, 0, 0};
  if (control(set_address, data) != Status::ok) return false;
  if (control(get_descriptor(kDescriptorDevice, 18), data) != Status::ok || data.size() != 18 || data[0] != 18 ||
      data[1] != kDescriptorDevice || data[7] != kControlPacket)
    return false;
  info_.vendor = word(data, 8);
  info_.product = word(data, 10);
  info_.release = word(data, 12);
  info_.code = {data[4], data[5], data[6]};
  info_.configurations = data[17];
  if (control(get_descriptor(kDescriptorConfiguration, 9), data) != Status::ok || data.size() != 9) return false;
  const std::size_t total = word(data, 2);
  if (control(get_descriptor(kDescriptorConfiguration, total), data) != Status::ok || data.size() != total)
    return false;
  return read_configuration(data);
}

bool HostController::read_configuration(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 9 || bytes[1] != kDescriptorConfiguration) return false;
  info_.configuration = bytes[5];
  for (std::size_t at = 0; at < bytes.size(); at += bytes[at]) {
    const auto d = bytes.subspan(at);
    if (d.size() < 2 || d[0] < 2 || d[0] > d.size()) return false;
    if (d[1] == kDescriptorInterface) {
      if (d[0] < 9) return false;
      if (d[3] == 0) info_.interfaces.push_back({d[5], d[6], d[7]});
    } else if (d[1] == kDescriptorEndpoint) {
      if (d[0] < 7 || word(d, 4) == 0) return false;
      info_.packet_bytes[d[2]] = word(d, 4);
    }
  }
  return info_.interfaces.size() == bytes[4];
}

Status HostController::control(std::span<const std::uint8_t, 8> setup, std::vector<std::uint8_t>& data) {
  const bool to_host = (setup[0] & kToHost) != 0;
  const std::size_t length = word(setup, 6);
  std::vector<std::uint8_t> packet;
  const auto status_in = [&] {
    const Status status = status_of(device_.in(0, packet));
    return status == Status::ok && !packet.empty() ? Status::protocol : status;
  };
  device_.setup(setup);
  if (length == 0) {
    data.clear();
    return status_in();
  }
  if (!to_host) {
    if (data.size() != length) return Status::bad_request;
    for (std::size_t at = 0; at < length; at += kControlPacket) {
      const Status status =
          status_of(device_.out(0, std::span(data).subspan(at, std::min(kControlPacket, length - at))));
      if (status != Status::ok) return status;
    }
    return status_in();
  }
  data.clear();
  do {
    const Status status = status_of(device_.in(0, packet));
    if (status != Status::ok) return status;
    data.insert(data.end(), packet.begin(), packet.end());
    if (data.size() > length) return Status::overflow;
  } while (packet.size() == kControlPacket && data.size() < length);
  return status_of(device_.out(0, {}));
}

std::size_t HostController::packet_bytes(std::uint8_t address) const {
  const auto found = info_.packet_bytes.find(address);
  return found == info_.packet_bytes.end() ? 0 : found->second;
}

HostController::Step HostController::in(std::uint8_t endpoint, std::size_t bytes, std::vector<std::uint8_t>& data,
                                        Status& status) {
  const std::size_t full = packet_bytes(static_cast<std::uint8_t>(endpoint | kToHost));
  status = Status::no_endpoint;
  if (full == 0) return Step::failed;
  std::vector<std::uint8_t> packet;
  do {
    const Handshake hand = device_.in(endpoint, packet);
    if (hand == Handshake::nak) return Step::later;
    status = status_of(hand);
    if (status != Status::ok) return Step::failed;
    data.insert(data.end(), packet.begin(), packet.end());
    if (data.size() > bytes) {
      data.resize(bytes);
      status = Status::overflow;
      return Step::failed;
    }
  } while (packet.size() == full && data.size() < bytes);
  return Step::done;
}

HostController::Step HostController::out(std::uint8_t endpoint, std::span<const std::uint8_t> data, bool end_empty,
                                         std::size_t& packets, Status& status) {
  const std::size_t full = packet_bytes(endpoint);
  status = Status::no_endpoint;
  if (full == 0) return Step::failed;
  // Without data one empty packet is sent.
  const bool extra = data.empty() || (end_empty && data.size() % full == 0);
  const std::size_t all = (data.size() + full - 1) / full + (extra ? 1 : 0);
  for (; packets < all; ++packets) {
    const std::size_t at = std::min(packets * full, data.size());
    const Handshake hand = device_.out(endpoint, data.subspan(at, std::min(full, data.size() - at)));
    if (hand == Handshake::nak) return Step::later;
    status = status_of(hand);
    if (status != Status::ok) return Step::failed;
  }
  status = Status::ok;
  return Step::done;
}

}  // namespace flexspline::usbip
