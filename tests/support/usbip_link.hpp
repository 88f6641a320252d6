// A drive behind a USB/IP server as a way to a drive: what Linux's USB stack and hidapi are on a desktop, in one
// process and as fast as the server. Reports by interrupt transfers, some waiting at the device as Linux has them.
#pragma once

#include <poll.h>

#include <chrono>
#include <deque>
#include <set>
#include <thread>

#include "host/drive_link/transport/link.hpp"
#include "tests/support/usbip_client.hpp"

namespace flexspline::tests {

class UsbIpLink : public transport::Link {
 public:
  // `pause`: how long the host does nothing after each report that it takes.
  explicit UsbIpLink(std::uint16_t port, std::chrono::milliseconds pause = std::chrono::milliseconds(0))
      : pause_(pause) {
    socket_ = connected(port);
    write_all(import_request("1-1"));
    const Octets head = read_all(8);
    if (get32(head, 4) != 0) throw transport::LinkError("the device cannot be attached");
    const Octets device = read_all(312);
    device_ = get32(device, 288) << 16 | get32(device, 292);
    submit({.setup = UsbIpClient::setup(0x00, 9, 1, 0, 0)});  // SET_CONFIGURATION
    constexpr int kWaiting = 4;
    for (int i = 0; i < kWaiting; ++i) ask_for_report();
  }
  ~UsbIpLink() override { close(socket_); }
  UsbIpLink(const UsbIpLink&) = delete;
  UsbIpLink& operator=(const UsbIpLink&) = delete;

  void send(const protocol::Message& m) override {
    const protocol::Report report = protocol::encode(m);
    submit({.endpoint = 1, .data = Octets(report.begin(), report.end())});
  }
  std::optional<protocol::Message> receive(transport::Milliseconds limit) override {
    const auto end = std::chrono::steady_clock::now() + limit;
    for (;;) {
      if (!arrived_.empty()) {
        const protocol::Message m = arrived_.front();
        arrived_.pop_front();
        if (pause_.count() > 0) std::this_thread::sleep_for(pause_);
        return m;
      }
      const auto left = std::chrono::duration_cast<transport::Milliseconds>(end - std::chrono::steady_clock::now());
      if (!can_read(std::max<long>(left.count(), 0))) return {};
      take();
    }
  }
  std::string name() const override { return "hid:by-usbip"; }
  std::uint64_t reports() const { return reports_; }

 private:
  bool can_read(long wait_ms) {
    pollfd one{socket_, POLLIN, 0};
    return poll(&one, 1, static_cast<int>(wait_ms)) > 0;
  }
  void write_all(const Octets& bytes) {
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t n = ::send(socket_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
      if (n <= 0) throw transport::LinkError(name() + ": the drive is gone");
      at += static_cast<std::size_t>(n);
    }
  }
  Octets read_all(std::size_t size) {
    Octets bytes(size);
    for (std::size_t at = 0; at < size;) {
      const ssize_t n = recv(socket_, bytes.data() + at, size - at, 0);
      if (n <= 0) throw transport::LinkError(name() + ": the drive is gone");
      at += static_cast<std::size_t>(n);
    }
    return bytes;
  }
  void submit(Submit s) {
    s.sequence = ++sequence_;
    s.device = device_;
    if (s.in) asked_.insert(s.sequence);
    write_all(submit_bytes(s));
  }
  void ask_for_report() { submit({.endpoint = 1, .in = true, .length = 64}); }
  // One answer of the server.
  void take() {
    const Octets head = read_all(48);
    if (asked_.erase(get32(head, 4)) == 0) return;  // of a report or request that went out
    const Octets data = read_all(get32(head, 24));
    protocol::Message m;
    if (protocol::decode(data, m)) arrived_.push_back(m);
    ++reports_;
    ask_for_report();
  }

  std::chrono::milliseconds pause_;
  int socket_ = -1;
  std::uint32_t device_ = 0, sequence_ = 0;
  std::set<std::uint32_t> asked_;
  std::deque<protocol::Message> arrived_;
  std::uint64_t reports_ = 0;
};

}  // namespace flexspline::tests
