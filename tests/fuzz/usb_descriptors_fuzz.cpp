// Descriptors of a device that may say anything: the twin's host controller and the checker of shared/usb read them.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <span>
#include <vector>

#include "hil/usbip/host_controller.hpp"
#include "shared/usb/descriptors.hpp"
#include "tests/fuzz/bytes.hpp"
#include "tests/support/usb_host.hpp"

namespace {

using namespace flexspline;
using tests::FuzzBytes;

// Answers each request with the next piece of the input, in packets, or not at all.
class AnyDevice : public usbip::BusDevice {
 public:
  explicit AnyDevice(FuzzBytes& bytes) : bytes_(bytes) {}
  void reset() override {}
  void setup(std::span<const std::uint8_t, 8> s) override {
    const std::size_t asked = s[6] | std::size_t{s[7]} << 8;
    const bool whole = (s[0] & 0x80) != 0 && (bytes_.next() & 0x80) == 0;
    answer_ = bytes_.some(whole ? asked : bytes_.next());
    at_ = 0;
  }
  usbip::Handshake in(std::uint8_t, std::vector<std::uint8_t>& packet) override {
    const std::uint8_t mood = bytes_.next();
    if (mood > 0xfc) return static_cast<usbip::Handshake>(mood & 3);
    const std::size_t n = std::min<std::size_t>(answer_.size() - at_, 64);
    packet.assign(answer_.begin() + static_cast<long>(at_), answer_.begin() + static_cast<long>(at_ + n));
    at_ += n;
    return usbip::Handshake::ack;
  }
  usbip::Handshake out(std::uint8_t, std::span<const std::uint8_t>) override { return usbip::Handshake::ack; }

 private:
  FuzzBytes& bytes_;
  std::vector<std::uint8_t> answer_;
  std::size_t at_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // What the checker lets through, the tests' own reader understands, endpoints and all.
  const tests::Octets whole(data, data + size);
  if (usb::check_configuration(whole) == usb::DescriptorFinding::none) {
    const auto read = tests::read_configuration(whole);
    std::size_t endpoints = 0, expected = 0;
    usb::for_each_endpoint(whole, [&](const usb::EndpointSetup&, std::uint8_t, std::uint8_t) { ++endpoints; });
    if (read)
      for (const auto& i : read->list) expected += i.promised;
    // A second configuration descriptor within is the reader's business.
    if (read && (endpoints != expected || read->total != size)) {
      std::fprintf(stderr, "usb_descriptors_fuzz: the checker let through what is wrong\n");
      std::abort();
    }
  }
  FuzzBytes bytes(data, size);
  AnyDevice device(bytes);
  usbip::HostController host(device);
  if (host.enumerate()) {
    usbip::Status status = usbip::Status::ok;
    std::vector<std::uint8_t> got;
    for (const auto& [address, packet] : host.info().packet_bytes) {
      std::size_t packets = 0;
      host.in(address & 0x0f, 100, got, status);
      host.out(address & 0x0f, whole, true, packets, status);
    }
  }
  return 0;
}
