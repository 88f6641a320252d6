// Devices for tests of the USB core: HID alone, and a composite one with a class that uses endpoint 0 only.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "shared/usb/device.hpp"
#include "shared/usb/hid.hpp"
#include "shared/usb/identity.hpp"
#include "tests/support/usb_host.hpp"

namespace flexspline::tests {

// Gives and takes blocks over endpoint 0, in two alternate settings, as a firmware-update class does.
struct BlockClass {
  static constexpr std::size_t kInterfaces = 1, kInEndpoints = 0, kOutEndpoints = 0, kControlBytes = 200;
  static constexpr std::size_t kAlternates = 2;
  static constexpr std::array<std::string_view, 2> kStrings{"first area", "second area"};
  static constexpr auto descriptors(usb::Place place) {
    const auto of = [&](std::uint8_t alternate) {
      return usb::interface_descriptor({.number = place.interface,
                                        .alternate = alternate,
                                        .code = 0xff,
                                        .string = static_cast<std::uint8_t>(place.string + alternate)});
    };
    return usb::joined(of(0), of(1));
  }
  template <class Link>
  void start(Link&) {
    selected = 0;
    running = true;
  }
  void stop() { running = false; }
  template <class Link>
  void poll(Link&) {}
  template <class Link>
  void sent(Link&, std::size_t) {}
  template <class Link>
  void received(Link&, std::size_t, std::span<const std::uint8_t>) {}
  template <class Link>
  void resume(Link&, bool, std::size_t) {}
  // wValue bytes that count up.
  usb::Reply control_in(const usb::Setup& setup, std::span<std::uint8_t> room) {
    if (setup.kind() == usb::RequestKind::standard || setup.value > kControlBytes) return usb::kRefused;
    for (std::size_t i = 0; i < setup.value; ++i) room[i] = static_cast<std::uint8_t>(i);
    return usb::reply_with(room.first(setup.value));
  }
  bool control_out(const usb::Setup&, std::span<const std::uint8_t> data) {
    taken.assign(data.begin(), data.end());
    ++blocks;
    return data.empty() || data[0] != 0xee;
  }
  void control_done(const usb::Setup&) { ++ended; }
  void set_alternate(std::uint8_t a) { selected = a; }
  std::uint8_t alternate() const { return selected; }

  Octets taken;
  int blocks = 0, ended = 0;
  std::uint8_t selected = 0;
  bool running = false;
};

using SmallHid = usb::Hid<4, 3>;
using OtherHid = usb::Hid<2, 2>;

template <bool kBefore, class... Classes>
struct Bench {
  using Wire = TestPort<kBefore>;
  using Device = usb::Device<usb::FlexsplineIdentity, Wire, Classes...>;
  Wire wire;
  Device device{wire, "0123456789AB"};
  TestHost<Device, Wire> host{device, wire};
};
using HidBench = Bench<false, SmallHid>;
using CompositeBench = Bench<false, SmallHid, BlockClass, OtherHid>;

inline Octets counting(std::size_t n, std::uint8_t first = 0) {
  Octets bytes(n);
  for (std::size_t i = 0; i < n; ++i) bytes[i] = static_cast<std::uint8_t>(first + i);
  return bytes;
}
inline usb::Report report_of(std::uint8_t mark) {
  usb::Report report;
  report.fill(mark);
  return report;
}

}  // namespace flexspline::tests
