#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hil/usbip/bus_device.hpp"
#include "shared/usb/port.hpp"

namespace flexspline::usbip {

/// The port of shared/usb without hardware: it stores the packet of each endpoint until the bus asks for it.
class SoftwarePort {
 public:
  static constexpr bool kAddressBeforeStatus = false;

  void set_address(std::uint8_t address) { address_ = address; }
  void open(const usb::EndpointSetup& endpoint) { at(endpoint.address) = {.open = true}; }
  void close(std::uint8_t address) { at(address) = {}; }
  void send(std::uint8_t number, std::span<const std::uint8_t> packet) {
    Pipe& pipe = at(number | usb::kToHost);
    pipe.packet.assign(packet.begin(), packet.end());
    pipe.ready = true;
  }
  void receive(std::uint8_t number) { at(number).ready = true; }
  void stall(std::uint8_t address) { at(address) = {.open = at(address).open, .stalled = true}; }
  void unstall(std::uint8_t address) { at(address) = {.open = at(address).open}; }

  // For the bus.

  void bus_reset() {
    pipes_ = {};
    address_ = 0;
    setup_came();
  }
  void setup_came() { at(0) = at(usb::kToHost) = {.open = true}; }
  /// Takes the packet that is ready for the host.
  Handshake take(std::uint8_t number, std::vector<std::uint8_t>& packet) {
    Pipe& pipe = at(number | usb::kToHost);
    const Handshake hand = answer(pipe);
    if (hand == Handshake::ack) {
      packet.swap(pipe.packet);
      pipe.ready = false;
    }
    return hand;
  }
  /// Whether a packet from the host is accepted; it then belongs to the device.
  Handshake offer(std::uint8_t number) {
    Pipe& pipe = at(number);
    const Handshake hand = answer(pipe);
    if (hand == Handshake::ack) pipe.ready = false;
    return hand;
  }
  std::uint8_t address() const { return address_; }

 private:
  struct Pipe {
    bool open = false;
    bool stalled = false;
    bool ready = false;  // a packet is ready, or one may be received
    std::vector<std::uint8_t> packet{};
  };
  static Handshake answer(const Pipe& pipe) {
    if (!pipe.open) return Handshake::silence;
    if (pipe.stalled) return Handshake::stall;
    return pipe.ready ? Handshake::ack : Handshake::nak;
  }
  Pipe& at(int address) { return pipes_[static_cast<std::size_t>((address & 0x0f) | ((address & 0x80) >> 3))]; }

  std::array<Pipe, 32> pipes_{};
  std::uint8_t address_ = 0;
};
static_assert(usb::Port<SoftwarePort>);

}  // namespace flexspline::usbip
