#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hil/twin/host_line.hpp"
#include "hil/usbip/core_device.hpp"
#include "hil/usbip/server.hpp"
#include "shared/usb/dfu.hpp"
#include "shared/usb/hid.hpp"
#include "shared/usb/identity.hpp"

namespace flexspline::twin {

/// A drive's USB connector, which hosts reach by USB/IP: the drive's own device core, a message in each report. A host
/// that detaches, deconfigures or resets the device counts as lost.
class UsbLine final : public HostLine {
 public:
  static constexpr const char* kBusId = "1-1";

  /// Port 0: any that is free. Throws std::runtime_error where it cannot listen.
  UsbLine(int port, const std::string& serial);

  std::uint16_t port() const { return server_.port(); }
  /// The drive leaves the bus and returns as after power-on.
  void reconnect();
  void plug_in();
  usbip::Server& bus() { return server_; }
  /// Its run-time interface for firmware updates.
  usb::DfuRuntime& dfu() { return connector_->device.get<usb::DfuRuntime>(); }
  std::string name() const override { return "hid:" + serial_; }
  bool transfer(int wait_ms) override;
  void plug(bool in) override;
  bool has_host() const override { return connector_->device.configured(); }
  const protocol::Message* front() override;
  void drop() override { is_waiting_ = false; }
  bool has_room() const override;
  void send(const protocol::Message& m) override;

 private:
  // Room for the telemetry between two frames of the bus, and for more requests than a host has open.
  using Reports = usb::Hid<16, 4>;

  // If one host leaves and another one connects between two calls, their resets show it.
  using Connector = usbip::ResetNotingDevice<usbip::CoreDevice<usb::FlexsplineIdentity, Reports, usb::DfuRuntime>>;

  std::string serial_;
  Reports& reports() const { return connector_->device.get<Reports>(); }

  std::unique_ptr<Connector> connector_;
  usbip::Server server_;
  protocol::Message waiting_{};
  bool is_waiting_ = false;
  bool had_host_ = false;
  bool plugged_ = true;
};

}  // namespace flexspline::twin
