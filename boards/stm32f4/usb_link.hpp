// USB as a link of the drive: a HID device's reports, and the port that it is polled through.
#pragma once

#include "firmware/report_link.hpp"
#include "shared/usb/hid.hpp"

namespace flexspline::stm32f4 {

template <class Service, class Port, class Device, class Reports>
class UsbLink {
 public:
  // `runs`: the port was started; else it is never polled.
  UsbLink(Service& service, Port& port, Device& device, bool runs)
      : port_(port), device_(device), reports_(service, device.template get<Reports>()), runs_(runs) {}

  bool poll() {
    if (!runs_) return false;
    port_.poll(device_);
    reports_.poll(device_.configured());
    device_.poll();
    return device_.configured();
  }

 private:
  Port& port_;
  Device& device_;
  firmware::ReportLink<Service, Reports> reports_;
  bool runs_;
};

}  // namespace flexspline::stm32f4
