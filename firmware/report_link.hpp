// Connects the service with reports of 64 bytes (USB HID): whole messages both ways, none lost on the drive's side.
#pragma once

#include <span>

#include "shared/protocol/message.hpp"

namespace flexspline::firmware {

// `Reports` has receive(report), which is false where none is available, send(report), and room() for reports to the
// host (shared/usb/hid.hpp). Reports that are not a message are ignored.
template <class Service, class Reports>
class ReportLink {
 public:
  ReportLink(Service& service, Reports& reports) : service_(service), reports_(reports) {}

  // Called repeatedly from background work; `connected`: a host has configured the device.
  void poll(bool connected) {
    if (connected != connected_) service_.disconnected();
    if (connected != connected_) waits_ = false;
    connected_ = connected;
    if (!connected) return;
    // A request for which the service has no room waits here, later ones in their endpoint.
    protocol::Report report;
    if (!waits_) waits_ = reports_.receive(report) && protocol::decode(report, request_);
    if (waits_) waits_ = !service_.take(request_);
    protocol::Message m;
    while (reports_.room() > 0 && service_.next(m)) reports_.send(protocol::encode(m));
  }

 private:
  Service& service_;
  Reports& reports_;
  protocol::Message request_{};
  bool waits_ = false;
  bool connected_ = false;
};

}  // namespace flexspline::firmware
