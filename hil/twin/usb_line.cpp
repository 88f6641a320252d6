#include "hil/twin/usb_line.hpp"

#include <span>
#include <utility>

namespace flexspline::twin {

UsbLine::UsbLine(int port, const std::string& serial)
    : serial_(serial), connector_(std::make_unique<Connector>(serial)), server_(static_cast<std::uint16_t>(port)) {
  server_.plug(kBusId, *connector_);
}

void UsbLine::reconnect() {
  server_.unplug(kBusId);
}

void UsbLine::plug_in() {
  server_.unplug(kBusId);
  connector_ = std::make_unique<Connector>(serial_);
  is_waiting_ = had_host_ = false;
  if (plugged_) server_.plug(kBusId, *connector_);
}

bool UsbLine::transfer(int wait_ms) {
  server_.serve(wait_ms);
  const bool had_host = std::exchange(had_host_, has_host());
  const bool changed = std::exchange(connector_->was_reset, false) || had_host != had_host_;
  if (changed) is_waiting_ = false;
  return changed;
}

void UsbLine::plug(bool in) {
  if (in == std::exchange(plugged_, in)) return;
  if (in) {
    server_.plug(kBusId, *connector_);
  } else {
    server_.unplug(kBusId);
  }
}

const protocol::Message* UsbLine::front() {
  // A report without a message is ignored, as in the drive.
  usb::Report report;
  while (!is_waiting_ && reports().receive(report)) is_waiting_ = protocol::decode(report, waiting_);
  return is_waiting_ ? &waiting_ : nullptr;
}

bool UsbLine::has_room() const {
  return !has_host() || reports().room() > 0;
}

void UsbLine::send(const protocol::Message& m) {
  reports().send(protocol::encode(m));
  connector_->device.poll();
}

}  // namespace flexspline::twin
