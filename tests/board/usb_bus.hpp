// A USB host before the modelled controller: transfers of packets with their toggles, each retried while the device
// says NAK, for which a tick passes.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "shared/protocol/payloads.hpp"
#include "tests/board/chip.hpp"

namespace flexspline::tests {

class UsbBus {
 public:
  explicit UsbBus(Chip& chip) : chip_(chip) {}

  // A bus reset and what a host does first. False: a step failed.
  bool enumerate(std::uint8_t address = 9) {
    chip_.otg.plug(true);
    reset();
    if (!control_out({0x00, 5, address, 0, 0, 0, 0, 0})) return false;
    address_ = address;
    return control_out({0x00, 9, 1, 0, 0, 0, 0, 0});
  }
  void reset() {
    chip_.otg.bus_reset();
    chip_.ticks(2);
    address_ = 0;
    in_data1_ = out_data1_ = false;
  }
  void move_to(std::uint8_t address) { address_ = address; }

  // Control transfers. Nothing: the device stalled, or was silent.
  std::optional<std::vector<std::uint8_t>> control_in(const std::vector<std::uint8_t>& setup) {
    if (!send_setup(setup)) return {};
    const std::size_t wanted = setup[6] + 256U * setup[7];
    std::vector<std::uint8_t> all, packet;
    for (bool toggle = true;; toggle = !toggle) {
      if (in(0, packet, toggle) != Handshake::ack) return {};
      all.insert(all.end(), packet.begin(), packet.end());
      if (packet.size() < 64 || all.size() >= wanted) break;
    }
    if (out(0, {}, true) != Handshake::ack) return {};
    chip_.tick();
    return all;
  }
  bool control_out(const std::vector<std::uint8_t>& setup, std::span<const std::uint8_t> data = {}) {
    if (!send_setup(setup)) return false;
    bool toggle = true;
    for (std::size_t at = 0; at < data.size(); at += 64, toggle = !toggle)
      if (out(0, data.subspan(at, std::min<std::size_t>(64, data.size() - at)), toggle) != Handshake::ack) return false;
    std::vector<std::uint8_t> status;
    const bool done = in(0, status, true) == Handshake::ack && status.empty();
    chip_.tick();
    return done;
  }
  std::vector<std::uint8_t> descriptor(std::uint8_t type, std::uint8_t index, std::uint8_t length) {
    return control_in({0x80, 6, index, type, 0, 0, length, 0}).value_or(std::vector<std::uint8_t>{});
  }

  // Reports on endpoint 1.
  Handshake write(std::span<const std::uint8_t> report) {
    const Handshake hand = out(1, report, out_data1_);
    if (hand == Handshake::ack) out_data1_ = !out_data1_;
    return hand;
  }
  Handshake read(std::vector<std::uint8_t>& report) {
    const Handshake hand = in(1, report, in_data1_);
    if (hand == Handshake::ack) in_data1_ = !in_data1_;
    return hand;
  }
  void toggles_begin_anew() { in_data1_ = out_data1_ = false; }

  // Requests of the drive's protocol. Telemetry that comes in between is kept in `frames`.
  template <class Payload>
  protocol::Message ask(protocol::Kind kind, const Payload& payload) {
    const protocol::Message request = protocol::request(kind, ++number_, payload);
    EXPECT_EQ(write(protocol::encode(request)), Handshake::ack);
    std::vector<std::uint8_t> report;
    protocol::Message m;
    for (int i = 0; i < 200; ++i) {
      if (read(report) != Handshake::ack || !protocol::decode(report, m)) continue;
      if (!m.is_unasked()) {
        EXPECT_EQ(m.number, request.number);
        return m;
      }
      frames.push_back(m);
    }
    ADD_FAILURE() << "no answer to a request of kind " << int{request.kind};
    return {};
  }
  protocol::Message ask(protocol::Kind kind) { return ask(kind, protocol::Empty{}); }
  template <class Payload>
  protocol::Code code(protocol::Kind kind, const Payload& payload) {
    return static_cast<protocol::Code>(ask(kind, payload).code);
  }
  protocol::Status status() {
    protocol::Status s;
    EXPECT_EQ(protocol::take_payload(ask(protocol::Kind::status).content(), s), protocol::Code::done);
    return s;
  }

  std::vector<protocol::Message> frames;

 private:
  static constexpr int kPatience = 100;  // ticks of NAK

  bool send_setup(const std::vector<std::uint8_t>& setup) {
    if (chip_.otg.setup(address_, setup) != Handshake::ack) return false;
    chip_.tick();
    return true;
  }
  Handshake in(std::uint8_t endpoint, std::vector<std::uint8_t>& packet, bool toggle) {
    for (int i = 0; i < kPatience; ++i) {
      bool data1 = false;
      const Handshake hand = chip_.otg.in(address_, endpoint, packet, data1);
      if (hand == Handshake::ack && data1 != toggle) ADD_FAILURE() << "a wrong toggle on endpoint " << int{endpoint};
      if (hand != Handshake::nak) return hand;
      chip_.tick();
    }
    return Handshake::nak;
  }
  Handshake out(std::uint8_t endpoint, std::span<const std::uint8_t> packet, bool toggle) {
    for (int i = 0; i < kPatience; ++i) {
      const Handshake hand = chip_.otg.out(address_, endpoint, packet, toggle);
      if (hand != Handshake::nak) return hand;
      chip_.tick();
    }
    return Handshake::nak;
  }

  Chip& chip_;
  std::uint8_t address_ = 0, number_ = 0;
  bool in_data1_ = false, out_data1_ = false;
};

}  // namespace flexspline::tests
