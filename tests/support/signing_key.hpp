// A pair of keys as a host has it, by libsodium.
#pragma once

#include <gtest/gtest.h>
#include <sodium.h>

#include <array>
#include <cstdint>
#include <span>

#include "shared/boot/signature/ed25519.hpp"
#include "shared/protocol/payloads.hpp"

namespace flexspline::tests {

struct SigningKey {
  explicit SigningKey(unsigned char seed) {
    EXPECT_GE(sodium_init(), 0);
    std::array<unsigned char, crypto_sign_SEEDBYTES> seeds{};
    seeds.fill(seed);
    crypto_sign_seed_keypair(public_key.data(), secret.data(), seeds.data());
  }
  ed25519::Signature sign(std::span<const std::uint8_t> message) const {
    ed25519::Signature signature{};
    crypto_sign_detached(signature.data(), nullptr, message.data(), message.size(), secret.data());
    return signature;
  }
  protocol::PairingKey public_key{};
  std::array<unsigned char, crypto_sign_SECRETKEYBYTES> secret{};
};

// Of the drive in most tests.
inline const SigningKey& owner() {
  static const SigningKey key(1);
  return key;
}

}  // namespace flexspline::tests
