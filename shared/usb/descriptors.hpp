// Descriptors, made at compile time from a list of classes: one configuration, with the interfaces and endpoints of
// each class one after the other. A static_assert where a device is made checks them against the specification.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <utility>

#include "shared/usb/chapter9.hpp"
#include "shared/usb/port.hpp"

namespace flexspline::usb {

template <std::size_t n>
using Bytes = std::array<std::uint8_t, n>;

constexpr std::uint8_t low(std::size_t word) {
  return static_cast<std::uint8_t>(word & 0xff);
}
constexpr std::uint8_t high(std::size_t word) {
  return static_cast<std::uint8_t>((word >> 8) & 0xff);
}

// One array after the other.
template <std::size_t... n>
constexpr Bytes<(n + ... + 0)> joined(const Bytes<n>&... parts) {
  Bytes<(n + ... + 0)> all{};
  std::size_t at = 0;
  const auto add = [&](const auto& part) {
    for (const std::uint8_t byte : part) all[at++] = byte;
  };
  (add(parts), ...);
  return all;
}

// Indices of strings. Those of the classes follow.
inline constexpr std::uint8_t kManufacturerString = 1;
inline constexpr std::uint8_t kProductString = 2;
inline constexpr std::uint8_t kSerialString = 3;
inline constexpr std::uint8_t kFirstClassString = 4;
inline constexpr std::uint16_t kEnglish = 0x0409;

// The place of a class in the configuration: its first interface, endpoint numbers and string.
struct Place {
  std::uint8_t interface = 0;
  std::uint8_t in = 1;
  std::uint8_t out = 1;
  std::uint8_t string = kFirstClassString;
};

// A class of interfaces. The optional parts are in device.hpp, at ClassHooks.
template <class C>
concept InterfaceClass = requires(Place place) {
  { C::kInterfaces } -> std::convertible_to<std::size_t>;
  { C::kInEndpoints } -> std::convertible_to<std::size_t>;
  { C::kOutEndpoints } -> std::convertible_to<std::size_t>;
  { C::kControlBytes } -> std::convertible_to<std::size_t>;  // longest data of a control transfer, either direction
  { C::kStrings.size() } -> std::convertible_to<std::size_t>;
  C::descriptors(place);  // interface, class and endpoint descriptors, as std::array
};

// USB 2.0, table 9-12. Strings by index, zero for none.
struct InterfaceDescription {
  std::uint8_t number = 0;
  std::uint8_t alternate = 0;
  std::uint8_t endpoints = 0;
  std::uint8_t code = 0xff;  // vendor specific
  std::uint8_t subclass = 0;
  std::uint8_t protocol = 0;
  std::uint8_t string = 0;
};
constexpr Bytes<9> interface_descriptor(const InterfaceDescription& i) {
  return {9,           static_cast<std::uint8_t>(DescriptorType::interface),
          i.number,    i.alternate,
          i.endpoints, i.code,
          i.subclass,  i.protocol,
          i.string};
}
// Table 9-13. `interval_ms` for interrupt endpoints.
constexpr Bytes<7> endpoint_descriptor(const EndpointSetup& e, std::uint8_t interval_ms) {
  return {7,
          static_cast<std::uint8_t>(DescriptorType::endpoint),
          e.address,
          static_cast<std::uint8_t>(e.type),
          low(e.packet_bytes),
          high(e.packet_bytes),
          interval_ms};
}

// Table 9-8. `I` as FlexsplineIdentity (identity.hpp). Classes are stated per interface.
template <class I>
constexpr Bytes<18> device_descriptor() {
  return {18,
          static_cast<std::uint8_t>(DescriptorType::device),
          0x00,
          0x02,  // USB 2.0
          0,
          0,
          0,
          kPacketBytes,
          low(I::kVendorId),
          high(I::kVendorId),
          low(I::kProductId),
          high(I::kProductId),
          low(I::kRelease),
          high(I::kRelease),
          kManufacturerString,
          kProductString,
          kSerialString,
          1};
}

template <InterfaceClass... C>
struct Composition {
  static constexpr std::size_t kClasses = sizeof...(C);
  static constexpr std::size_t kInterfaces = (std::size_t{C::kInterfaces} + ... + 0);

  static constexpr std::array<Place, kClasses> places() {
    std::array<Place, kClasses> all{};
    Place next;
    std::size_t i = 0;
    const auto add = [&](std::size_t interfaces, std::size_t in, std::size_t out, std::size_t strings) {
      all[i++] = next;
      next = {low(next.interface + interfaces), low(next.in + in), low(next.out + out), low(next.string + strings)};
    };
    (add(C::kInterfaces, C::kInEndpoints, C::kOutEndpoints, C::kStrings.size()), ...);
    return all;
  }
  static constexpr std::array<Place, kClasses> kPlaces = places();

  // Table 9-10: self powered, 100 mA from the bus at most.
  static constexpr auto configuration() {
    const auto inner = []<std::size_t... i>(std::index_sequence<i...>) {
      return joined(C::descriptors(kPlaces[i])...);
    }
    (std::index_sequence_for<C...>{});
    constexpr std::size_t kTotal = std::tuple_size_v<decltype(inner)> + 9;
    return joined(Bytes<9>{9, static_cast<std::uint8_t>(DescriptorType::configuration), low(kTotal), high(kTotal),
                           kInterfaces, 1, 0, 0xc0, 50},
                  inner);
  }
  static constexpr auto kConfiguration = configuration();

  static constexpr std::string_view class_string(std::size_t index) {
    std::string_view found;
    std::size_t next = kFirstClassString;
    const auto look = [&](const auto& strings) {
      for (const std::string_view text : strings)
        if (next++ == index) found = text;
    };
    (look(C::kStrings), ...);
    return found;
  }
};

// The error in a configuration, for static_assert; zero for none.
enum class DescriptorFinding : std::uint8_t {
  none,
  header,           // not a configuration descriptor of nine bytes
  total_length,     // wTotalLength is not the length
  runs_over,        // a descriptor is longer than the remaining bytes, or shorter than two
  wrong_length,     // an interface or endpoint descriptor has a wrong length
  interface_order,  // numbers are not 0, 1, 2, ... with alternates 0, 1, 2, ...
  interface_count,
  endpoint_count,  // an interface states another number of endpoints
  endpoint_twice,  // by two interfaces, or twice in an alternate setting
  endpoint_bad,    // number zero, no interface before it, or a packet too long for full speed
};

constexpr DescriptorFinding check_configuration(std::span<const std::uint8_t> d) {
  using enum DescriptorFinding;
  if (d.size() < 9 || d[0] != 9 || d[1] != static_cast<std::uint8_t>(DescriptorType::configuration)) return header;
  if (d[2] + d[3] * 256U != d.size()) return total_length;
  int interface = -1, alternate = -1;
  unsigned missing = 0;
  std::uint32_t used = 0, used_by_others = 0, used_here = 0;
  for (std::size_t at = 9; at < d.size(); at += d[at]) {
    const std::size_t left = d.size() - at;
    if (left < 2 || d[at] < 2 || d[at] > left) return runs_over;
    if (d[at + 1] == static_cast<std::uint8_t>(DescriptorType::interface)) {
      if (d[at] != 9) return wrong_length;
      if (missing != 0) return endpoint_count;
      const bool another = d[at + 2] == interface && d[at + 3] == alternate + 1;
      const bool next = d[at + 2] == interface + 1 && d[at + 3] == 0;
      if (!another && !next) return interface_order;
      if (next) used_by_others = used;
      interface = d[at + 2];
      alternate = d[at + 3];
      missing = d[at + 4];
      used_here = 0;
    } else if (d[at + 1] == static_cast<std::uint8_t>(DescriptorType::endpoint)) {
      if (d[at] != 7) return wrong_length;
      const std::uint8_t number = d[at + 2] & kEndpointNumber;
      const unsigned bytes = d[at + 4] + d[at + 5] * 256U;
      const std::uint32_t bit = std::uint32_t{1} << (number + ((d[at + 2] & kToHost) != 0 ? 16 : 0));
      if (interface < 0 || number == 0 || bytes == 0 || bytes > kPacketBytes) return endpoint_bad;
      if ((used_by_others & bit) != 0 || (used_here & bit) != 0) return endpoint_twice;
      if (missing == 0) return endpoint_count;
      --missing;
      used |= bit;
      used_here |= bit;
    }
  }
  if (missing != 0) return endpoint_count;
  return interface + 1 == d[4] ? none : interface_count;
}

// Calls `use(EndpointSetup, interface, alternate)` for each endpoint of a configuration that was checked.
template <class Use>
constexpr void for_each_endpoint(std::span<const std::uint8_t> d, Use use) {
  std::uint8_t interface = 0, alternate = 0;
  for (std::size_t at = 0; at < d.size(); at += d[at]) {
    if (d[at + 1] == static_cast<std::uint8_t>(DescriptorType::interface)) {
      interface = d[at + 2];
      alternate = d[at + 3];
    } else if (d[at + 1] == static_cast<std::uint8_t>(DescriptorType::endpoint)) {
      use(EndpointSetup{d[at + 2], static_cast<TransferType>(d[at + 3] & 3),
                        static_cast<std::uint16_t>(d[at + 4] | (d[at + 5] << 8))},
          interface, alternate);
    }
  }
}

}  // namespace flexspline::usb
