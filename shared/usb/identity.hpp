// The drive's USB identity. The drive, the twin and the host take these numbers from here only.
#pragma once

#include <cstdint>
#include <string_view>

namespace flexspline::usb {

struct FlexsplineIdentity {
  // pid.codes' number for tests: replace it by your own before devices are distributed.
  static constexpr std::uint16_t kVendorId = 0x1209;
  static constexpr std::uint16_t kProductId = 0x0001;
  static constexpr std::uint16_t kRelease = 0x0010;  // 0.1.0, binary coded decimal
  static constexpr std::string_view kManufacturer = "Flexspline";
  static constexpr std::string_view kProduct = "Flexspline drive";
};

// The boot loader: DFU mode has a number of its own, so that a host does not take it for a drive.
struct LoaderIdentity : FlexsplineIdentity {
  static constexpr std::uint16_t kProductId = 0x0002;
  static constexpr std::string_view kProduct = "Flexspline boot loader";
};

}  // namespace flexspline::usb
