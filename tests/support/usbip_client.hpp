// A USB/IP client for tests, written from the protocol's text (Linux, Documentation/usb/usbip_protocol.rst) and apart
// from hil/usbip: bytes by offset. It runs in the server's thread and turns the server while it waits.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexspline::tests {

using Octets = std::vector<std::uint8_t>;

inline void set32(Octets& bytes, std::size_t at, std::uint32_t value) {
  for (int i = 0; i < 4; ++i)
    bytes.at(at + static_cast<std::size_t>(i)) = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}
inline std::uint32_t get32(const Octets& bytes, std::size_t at) {
  return std::uint32_t{bytes.at(at)} << 24 | std::uint32_t{bytes.at(at + 1)} << 16 |
         std::uint32_t{bytes.at(at + 2)} << 8 | bytes.at(at + 3);
}
inline std::uint32_t get16(const Octets& bytes, std::size_t at) {
  return std::uint32_t{bytes.at(at)} << 8 | bytes.at(at + 1);
}
inline std::string get_text(const Octets& bytes, std::size_t at) {
  std::string text;
  while (bytes.at(at) != 0) text += static_cast<char>(bytes.at(at++));
  return text;
}

inline Octets devlist_request() {
  return {0x01, 0x11, 0x80, 0x05, 0, 0, 0, 0};
}
inline Octets import_request(const std::string& bus_id) {
  Octets bytes{0x01, 0x11, 0x80, 0x03, 0, 0, 0, 0};
  bytes.resize(40);
  for (std::size_t i = 0; i < bus_id.size(); ++i) bytes[8 + i] = static_cast<std::uint8_t>(bus_id[i]);
  return bytes;
}

struct Submit {
  std::uint32_t sequence = 1, device = 0x00010001, endpoint = 0;
  bool in = false;
  Octets setup = Octets(8, 0);
  Octets data{};             // OUT
  std::uint32_t length = 0;  // IN
  std::uint32_t flags = 0;
};
inline Octets submit_bytes(const Submit& s) {
  Octets bytes(48, 0);
  set32(bytes, 0, 1);
  set32(bytes, 4, s.sequence);
  set32(bytes, 8, s.device);
  set32(bytes, 12, s.in ? 1 : 0);
  set32(bytes, 16, s.endpoint);
  set32(bytes, 20, s.flags);
  set32(bytes, 24, s.in ? s.length : static_cast<std::uint32_t>(s.data.size()));
  set32(bytes, 32, 0xffffffff);
  for (std::size_t i = 0; i < 8; ++i) bytes[40 + i] = s.setup.at(i);
  bytes.insert(bytes.end(), s.data.begin(), s.data.end());
  return bytes;
}
inline Octets unlink_bytes(std::uint32_t sequence, std::uint32_t unlinked, std::uint32_t device = 0x00010001) {
  Octets bytes(48, 0);
  set32(bytes, 0, 2);
  set32(bytes, 4, sequence);
  set32(bytes, 8, device);
  set32(bytes, 20, unlinked);
  return bytes;
}

struct Returned {
  std::uint32_t command = 0, sequence = 0;
  std::int32_t status = 0;
  std::uint32_t actual = 0;
  Octets data{};
};

// A socket to a server on this machine, without delay. Throws std::runtime_error where nobody listens.
inline int connected(std::uint16_t port) {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  if (connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    close(descriptor);
    throw std::runtime_error("nobody listens on port " + std::to_string(port));
  }
  const int on = 1;
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  return descriptor;
}

class UsbIpClient {
 public:
  UsbIpClient(std::uint16_t port, std::function<void()> turn) : turn_(std::move(turn)) {
    socket_ = connected(port);
    fcntl(socket_, F_SETFL, O_NONBLOCK);
  }
  ~UsbIpClient() { hang_up(); }
  UsbIpClient(const UsbIpClient&) = delete;
  UsbIpClient& operator=(const UsbIpClient&) = delete;

  void send(const Octets& bytes) {
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t n = ::send(socket_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
      if (n > 0) at += static_cast<std::size_t>(n);
      if (n < 0 && errno != EAGAIN) return;  // sent away
      turn_();
    }
  }
  void end_sending() { shutdown(socket_, SHUT_WR); }
  void hang_up() {
    if (socket_ >= 0) close(socket_);
    socket_ = -1;
  }
  // Exactly so many bytes; nothing where the server hangs up or says nothing for long.
  std::optional<Octets> receive(std::size_t n) {
    for (int patience = 0; got_.size() < n && patience < 2000; ++patience) {
      if (!read_some()) break;
      if (got_.size() < n) turn_();
    }
    if (got_.size() < n) return std::nullopt;
    const auto end = got_.begin() + static_cast<long>(n);
    const Octets bytes(got_.begin(), end);
    got_.erase(got_.begin(), end);
    return bytes;
  }
  // Whether the server hung up, after what it may still have sent.
  bool is_closed() {
    for (int patience = 0; patience < 500; ++patience) {
      if (!read_some()) return true;
      turn_();
    }
    return false;
  }
  std::size_t unread() {
    for (int i = 0; i < 10; ++i) {
      turn_();
      read_some();
    }
    return got_.size();
  }

  // Status of the reply to an import, -1 for none.
  int import(const std::string& bus_id) {
    send(import_request(bus_id));
    const auto head = receive(8);
    if (!head || get32(*head, 0) != 0x01110003) return -1;
    const auto status = static_cast<int>(get32(*head, 4));
    if (status != 0) return status;
    const auto device = receive(312);
    if (!device || get_text(*device, 256) != bus_id) return -1;
    device_ = get32(*device, 288) << 16 | get32(*device, 292);
    return 0;
  }
  std::uint32_t device() const { return device_; }

  std::optional<Returned> returned() {
    const auto head = receive(48);
    if (!head) return std::nullopt;
    Returned r{get32(*head, 0), get32(*head, 4), static_cast<std::int32_t>(get32(*head, 20)), get32(*head, 24), {}};
    const auto asked = lengths_.find(r.sequence);
    if (r.command == 3 && asked != lengths_.end() && r.actual > 0) {
      const auto data = receive(r.actual);
      if (!data) return std::nullopt;
      r.data = *data;
    }
    return r;
  }
  std::uint32_t submit(Submit s) {
    s.sequence = ++sequence_;
    s.device = device_;
    if (s.in) lengths_[s.sequence] = s.length;
    send(submit_bytes(s));
    return s.sequence;
  }
  std::uint32_t unlink(std::uint32_t sequence) {
    send(unlink_bytes(++sequence_, sequence, device_));
    return sequence_;
  }
  // Control transfers, whole. `setup` as in the specification's tables.
  Returned get(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
               std::uint16_t length) {
    submit({.in = true, .setup = setup(type, request, value, index, length), .length = length});
    return returned().value_or(Returned{.status = 1});
  }
  Returned set(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
               const Octets& data = {}) {
    submit({.setup = setup(type, request, value, index, static_cast<std::uint16_t>(data.size())), .data = data});
    return returned().value_or(Returned{.status = 1});
  }
  static Octets setup(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
                      std::uint16_t length) {
    const auto low = [](std::uint16_t w) { return static_cast<std::uint8_t>(w & 0xff); };
    const auto high = [](std::uint16_t w) { return static_cast<std::uint8_t>(w >> 8); };
    return {type, request, low(value), high(value), low(index), high(index), low(length), high(length)};
  }

 private:
  // False where the server hung up.
  bool read_some() {
    Octets bytes(65'536);
    const ssize_t n = recv(socket_, bytes.data(), bytes.size(), 0);
    if (n > 0) got_.insert(got_.end(), bytes.begin(), bytes.begin() + n);
    return n > 0 || (n < 0 && errno == EAGAIN);
  }

  std::function<void()> turn_;
  int socket_ = -1;
  Octets got_;
  std::uint32_t device_ = 0, sequence_ = 0;
  std::map<std::uint32_t, std::uint32_t> lengths_;
};

}  // namespace flexspline::tests
