// Ed25519 (RFC 8032, 5.1.7): whether a signature of a message is one by the secret key of a public key. It knows no
// secret. README.md has the rules that are stricter than the RFC's, and figures.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/boot/signature/point.hpp"
#include "shared/boot/signature/scalar.hpp"
#include "shared/boot/signature/sha512.hpp"

namespace flexspline::ed25519 {

inline constexpr std::size_t kKeyBytes = 32, kSignatureBytes = 64;
using PublicKey = std::array<std::uint8_t, kKeyBytes>;
using Signature = std::array<std::uint8_t, kSignatureBytes>;

// A public key that signatures may be made for: the canonical encoding of a point whose order is not small.
constexpr bool decode_key(std::span<const std::uint8_t, kKeyBytes> key, Point& point) {
  return decode(key, point) && !point.has_small_order();
}

// The message comes in parts: add() them, then ask once.
class Verification {
 public:
  // Both have to outlive this.
  constexpr Verification(const PublicKey& key, const Signature& signature) : key_(key), signature_(signature) {
    hash_.add(r());
    hash_.add(key_);
  }
  constexpr void add(std::span<const std::uint8_t> part) { hash_.add(part); }
  constexpr bool is_valid() {
    const Words s = words_of(std::span(signature_).last<32>());
    Point a;
    if (!is_less(s, kOrder) || !decode_key(key_, a)) return false;
    const Words k = modulo_order(hash_.finish());
    const Point sum = combination(s, k, a.negative());
    // R is not decoded: equal bytes make it the canonical encoding of S B - k A.
    const std::array<std::uint8_t, 32> encoded = sum.encoded();
    for (std::size_t i = 0; i < encoded.size(); ++i)
      if (encoded[i] != signature_[i]) return false;
    return !sum.has_small_order();
  }

 private:
  constexpr std::span<const std::uint8_t, 32> r() const { return std::span(signature_).first<32>(); }
  // s B + k A, both at once, from the highest bit on. Both numbers are below L, which has 253 bits.
  static constexpr Point combination(const Words& s, const Words& k, const Point& a) {
    const Point base{kBaseX, kBaseY, kOne, kBaseX * kBaseY};
    const std::array<Point, 3> sums{base, a, base + a};
    Point sum;
    for (std::size_t i = 253; i-- > 0;) {
      sum = sum.doubled();
      const std::size_t which = (bit_of(s, i) ? 1U : 0U) + (bit_of(k, i) ? 2U : 0U);
      if (which != 0) sum = sum + sums[which - 1];
    }
    return sum;
  }

  const PublicKey& key_;
  const Signature& signature_;
  Sha512 hash_;
};

constexpr bool verify(const PublicKey& key, const Signature& signature, std::span<const std::uint8_t> message) {
  Verification verification(key, signature);
  verification.add(message);
  return verification.is_valid();
}

}  // namespace flexspline::ed25519
