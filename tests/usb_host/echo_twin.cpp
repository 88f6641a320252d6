// A device without a drive behind it: sends every report back. On the command line, how many such devices; prints the
// port of its USB/IP server. A report that begins with kPullOut makes it pull its own plug, and put it in again.
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "hil/usbip/core_device.hpp"
#include "hil/usbip/server.hpp"
#include "shared/usb/hid.hpp"
#include "shared/usb/identity.hpp"

namespace {

using Reports = flexspline::usb::Hid<8, 4>;
using EchoDevice = flexspline::usbip::CoreDevice<flexspline::usb::FlexsplineIdentity, Reports>;
using Clock = std::chrono::steady_clock;

constexpr std::uint8_t kPullOut = 0xfe;
constexpr std::chrono::milliseconds kPulledOut{500};

volatile std::sig_atomic_t asked_to_end = 0;

struct Place {
  explicit Place(int number) : bus_id("1-" + std::to_string(number)), device("ECHO" + std::to_string(number)) {}
  std::string bus_id;
  EchoDevice device;
  bool plugged = true;
  Clock::time_point again{};
};

void serve(Place& place, flexspline::usbip::Server& server) {
  if (!place.plugged && Clock::now() >= place.again) {
    server.plug(place.bus_id, place.device);
    place.plugged = true;
  }
  Reports& reports = place.device.get<Reports>();
  flexspline::usb::Report report;
  while (reports.room() > 0 && reports.receive(report)) {
    if (report[0] == kPullOut) {
      place.plugged = false;
      place.again = Clock::now() + kPulledOut;
      server.unplug(place.bus_id);
      return;
    }
    reports.send(report);
  }
  place.device.poll();
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 1;
  std::signal(SIGTERM, [](int) { asked_to_end = 1; });
  try {
    std::vector<std::unique_ptr<Place>> places;
    flexspline::usbip::Server server(0);
    for (int i = 1; i <= count; ++i) {
      places.push_back(std::make_unique<Place>(i));
      server.plug(places.back()->bus_id, places.back()->device);
    }
    std::printf("port %u\n", unsigned{server.port()});
    std::fflush(stdout);
    while (asked_to_end == 0) {
      server.serve(5);
      for (const auto& place : places) serve(*place, server);
    }
    if (server.faults() > 0) {
      std::fprintf(stderr, "%llu clients were sent away\n", static_cast<unsigned long long>(server.faults()));
      return 1;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "echo_twin: %s\n", error.what());
    return 2;
  }
  return 0;
}
