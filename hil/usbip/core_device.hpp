#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hil/usbip/bus_device.hpp"
#include "hil/usbip/software_port.hpp"
#include "shared/usb/device.hpp"

namespace flexspline::usbip {

/// The drive's own device core (shared/usb) on a software port: `CoreDevice<usb::FlexsplineIdentity, usb::Hid<16, 4>>`.
/// The application reaches its classes by get(), and calls poll() after it has given them data to send.
template <class Identity, class... Classes>
class CoreDevice final : public BusDevice {
 public:
  explicit CoreDevice(std::string serial) : serial_(std::move(serial)) { reset(); }
  // The core holds references to its neighbours.
  CoreDevice(const CoreDevice&) = delete;
  CoreDevice& operator=(const CoreDevice&) = delete;

  template <class Class>
  Class& get() {
    return core_.template get<Class>();
  }
  bool configured() const { return core_.configured(); }
  void poll() { core_.poll(); }

  void reset() override {
    port_.bus_reset();
    core_.reset();
  }
  void setup(std::span<const std::uint8_t, 8> bytes) override {
    port_.setup_came();
    core_.setup(bytes);
  }
  Handshake in(std::uint8_t endpoint, std::vector<std::uint8_t>& packet) override {
    const Handshake hand = port_.take(endpoint, packet);
    if (hand == Handshake::ack) core_.sent(endpoint);
    return hand;
  }
  Handshake out(std::uint8_t endpoint, std::span<const std::uint8_t> packet) override {
    const Handshake hand = port_.offer(endpoint);
    if (hand == Handshake::ack) core_.received(endpoint, packet);
    return hand;
  }

 private:
  std::string serial_;
  SoftwarePort port_;
  usb::Device<Identity, SoftwarePort, Classes...> core_{port_, serial_};
};

/// Such a device on the bus, which notes that the host reset it. `polls`: what it received is served between two
/// packets.
template <class Device, bool polls = false>
struct ResetNotingDevice final : BusDevice {
  explicit ResetNotingDevice(const std::string& serial) : device(serial) {}
  void reset() override {
    device.reset();
    was_reset = true;
  }
  void setup(std::span<const std::uint8_t, 8> bytes) override { device.setup(bytes); }
  Handshake in(std::uint8_t endpoint, std::vector<std::uint8_t>& packet) override {
    return served(device.in(endpoint, packet));
  }
  Handshake out(std::uint8_t endpoint, std::span<const std::uint8_t> packet) override {
    return served(device.out(endpoint, packet));
  }
  Device device;
  bool was_reset = false;

 private:
  Handshake served(Handshake hand) {
    if constexpr (polls) device.poll();
    return hand;
  }
};

}  // namespace flexspline::usbip
