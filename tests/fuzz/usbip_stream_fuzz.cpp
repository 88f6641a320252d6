// The bytes of a USB/IP client, in pieces: a length, then so many bytes. The first byte says whether the conversation
// begins with an import that is as it has to be.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "hil/usbip/connection.hpp"
#include "hil/usbip/core_device.hpp"
#include "shared/usb/hid.hpp"
#include "shared/usb/identity.hpp"
#include "tests/fuzz/bytes.hpp"

using namespace flexspline;
using Reports = usb::Hid<4, 2>;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tests::FuzzBytes bytes(data, size);
  usbip::CoreDevice<usb::FlexsplineIdentity, Reports> device("FUZZ");
  usbip::Bus bus;
  bus.plug("1-1", device);
  {
    usbip::Connection talk(bus);
    if ((bytes.next() & 1) == 0) {
      std::vector<std::uint8_t> import{0x01, 0x11, 0x80, 0x03, 0, 0, 0, 0, '1', '-', '1'};
      import.resize(40);
      talk.take(import);
    }
    while (!bytes.empty() && !talk.finished()) {
      const std::uint8_t length = bytes.next();
      talk.take(bytes.some(length));
      usb::Report report;
      if (device.get<Reports>().receive(report)) device.get<Reports>().send(report);
      device.poll();
      talk.advance();
      if (talk.output().size() > 2 * usbip::Connection::kMostOutput) {
        std::fprintf(stderr, "usbip_stream_fuzz: answers without end\n");
        std::abort();
      }
      if (!talk.wants_input()) talk.output().clear();
    }
  }
  // The next client gets the device.
  if (bus.find("1-1")->imported || device.configured()) {
    std::fprintf(stderr, "usbip_stream_fuzz: the device was not let go\n");
    std::abort();
  }
  return 0;
}
