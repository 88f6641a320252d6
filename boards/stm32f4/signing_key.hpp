// The key that images have to be signed with, by the build: FLEXSPLINE_PUBLIC_KEY, 64 hexadecimal digits of `flexspline
// key --show`. Without it the development key, which is public.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "shared/boot/development_key.hpp"
#include "shared/protocol/payloads.hpp"

namespace flexspline::stm32f4 {

constexpr bool is_key(std::string_view text) {
  if (text.size() != 2 * ed25519::kKeyBytes) return false;
  for (const char c : text)
    if (!((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'))) return false;
  return true;
}
constexpr ed25519::PublicKey key_of(std::string_view text) {
  ed25519::PublicKey key{};
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int digit = text[i] <= '9' ? text[i] - '0' : text[i] - 'a' + 10;
    key[i / 2] = static_cast<std::uint8_t>(key[i / 2] << 4 | digit);
  }
  return key;
}

#ifdef FLEXSPLINE_PUBLIC_KEY
static_assert(is_key(FLEXSPLINE_PUBLIC_KEY), "a public key has 64 digits 0 to 9 and a to f");
inline constexpr ed25519::PublicKey kSigningKey = key_of(FLEXSPLINE_PUBLIC_KEY);
#else
inline constexpr ed25519::PublicKey kSigningKey = boot::kDevelopmentKey;
#endif
inline constexpr auto kFirmwareKey =
    kSigningKey == boot::kDevelopmentKey ? protocol::FirmwareKey::development : protocol::FirmwareKey::own;

// FLEXSPLINE_DFU_UPLOAD: whoever has the cable can read the firmware.
#ifdef FLEXSPLINE_DFU_UPLOAD
inline constexpr bool kCanUpload = true;
#else
inline constexpr bool kCanUpload = false;
#endif

}  // namespace flexspline::stm32f4
