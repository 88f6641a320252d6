// The key that boot loaders take and images are signed with where nobody states another. Both halves are public:
// whoever has the sources signs images that such a drive takes, and it says so in `identify`.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "shared/boot/signature/ed25519.hpp"

namespace flexspline::boot {

// RFC 8032's secret key: for the host and the twin, never in an image.
inline constexpr std::string_view kDevelopmentSecret = "flexspline: development, public!";
static_assert(kDevelopmentSecret.size() == ed25519::kKeyBytes);
inline constexpr ed25519::PublicKey kDevelopmentKey{0xef, 0xfe, 0x97, 0x0d, 0x50, 0x11, 0x23, 0x87, 0xcd, 0x9d, 0x60,
                                                    0x2c, 0xa1, 0xe8, 0xdf, 0x05, 0x75, 0x24, 0x3a, 0x40, 0x3d, 0x51,
                                                    0x7e, 0xe9, 0x3f, 0x25, 0xfa, 0x1b, 0x5a, 0x74, 0xe4, 0x82};

}  // namespace flexspline::boot
