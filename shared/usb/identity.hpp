// Who the drive says it is on the bus. The only place with its numbers: the drive, the twin and the host read them
// here.
#pragma once

#include <cstdint>
#include <string_view>

namespace flexspline::usb {

struct FlexsplineIdentity {
  // pid.codes' number for tests: to be changed for an own one before devices are given away.
  static constexpr std::uint16_t kVendorId = 0x1209;
  static constexpr std::uint16_t kProductId = 0x0001;
  static constexpr std::uint16_t kRelease = 0x0010;  // 0.1.0, binary coded decimal
  static constexpr std::string_view kManufacturer = "Flexspline";
  static constexpr std::string_view kProduct = "Flexspline drive";
};

// The boot loader: DFU mode has a number of its own, so that no host takes it for a drive.
struct LoaderIdentity : FlexsplineIdentity {
  static constexpr std::uint16_t kProductId = 0x0002;
  static constexpr std::string_view kProduct = "Flexspline boot loader";
};

}  // namespace flexspline::usb
