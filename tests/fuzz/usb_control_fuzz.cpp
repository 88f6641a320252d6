// Whatever a host does on the bus: SETUP packets, data, resets, in any order and of any length. The device keeps to its
// port's contract and can be enumerated afterwards.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/bytes.hpp"
#include "tests/support/usb_parts.hpp"

namespace {

using namespace flexspline::tests;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "usb_control_fuzz: %s\n", what);
  std::abort();
}

Request request(FuzzBytes& bytes) {
  Request r;
  r.type = bytes.next();
  r.request = bytes.next();
  r.value = bytes.word();
  r.index = bytes.word();
  r.length = bytes.word();
  return r;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzBytes bytes(data, size);
  CompositeBench b;
  require(b.host.enumerate(), "not to be enumerated");
  Octets packet;
  while (!bytes.empty()) {
    const std::uint8_t what = bytes.next();
    const auto endpoint = static_cast<std::uint8_t>((what >> 4) & 3);
    switch (what & 7) {
      case 0: {
        const Request r = request(bytes);
        const Done done = b.host.get(r);
        require(!done.hung || (r.type & 0x80) == 0, "a request to the host hangs");
        break;
      }
      case 1: {
        const Request r = request(bytes);
        const Octets sent = bytes.some(bytes.next());
        // Where the host promises more than it sends, the device waits for it.
        const Done done = b.host.put(r, sent);
        require(!done.hung || sent.size() != r.length || (r.type & 0x80) != 0, "a request to the device hangs");
        break;
      }
      case 2:
        b.host.setup(request(bytes));
        break;
      case 3:
        b.host.out(endpoint, bytes.some(bytes.next() & 0x7f));
        break;
      case 4:
        b.host.in(endpoint, packet);
        break;
      case 5:
        b.device.get<SmallHid>().send(report_of(what));
        b.device.poll();
        break;
      case 6: {
        flexspline::usb::Report report;
        b.device.get<SmallHid>().receive(report);
        b.device.get<OtherHid>().receive(report);
        b.device.poll();
        break;
      }
      case 7:
        if (endpoint == 0) {
          b.host.bus_reset();
        } else {
          b.host.enumerate();
        }
        break;
    }
    require(b.wire.broken.empty(), b.wire.broken.empty() ? "" : b.wire.broken.front().c_str());
  }
  require(b.host.enumerate(), "not to be enumerated any more");
  require(b.host.descriptor(2, 0, 255).data.size() == CompositeBench::Device::kConfiguration.size(),
          "its configuration cannot be read any more");
  return 0;
}
