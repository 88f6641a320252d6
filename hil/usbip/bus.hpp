#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hil/usbip/bus_device.hpp"
#include "hil/usbip/host_controller.hpp"

namespace flexspline::usbip {

/// A port of the bus with its device. Connections share it, so that they notice when the device is unplugged.
struct Slot {
  Slot(std::string id, std::uint16_t bus_number, std::uint16_t device_number, BusDevice& device)
      : bus_id(std::move(id)), bus(bus_number), number(device_number), host(device) {}
  std::uint32_t device_id() const { return std::uint32_t{bus} << 16 | number; }

  std::string bus_id;
  std::uint16_t bus;
  std::uint16_t number;
  HostController host;
  bool plugged = true;
  bool imported = false;
};

/// The devices that a server offers, by their bus ids (1-1, 1-2, ...).
class Bus {
 public:
  /// `device` has to live until it is unplugged. Throws std::invalid_argument for a bus id that is invalid or in use,
  /// and for a device that does not answer as USB requires.
  void plug(std::string_view bus_id, BusDevice& device);
  /// A client of the device loses it at once. False where there is none.
  bool unplug(std::string_view bus_id);
  std::shared_ptr<Slot> find(std::string_view bus_id) const;
  const std::vector<std::shared_ptr<Slot>>& slots() const { return slots_; }

 private:
  std::vector<std::shared_ptr<Slot>> slots_;
};

}  // namespace flexspline::usbip
