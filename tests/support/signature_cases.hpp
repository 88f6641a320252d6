// Signatures for tests of the drive's verification: good ones, and broken or contrived ones of every kind, each judged
// by libsodium as well.
#pragma once

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "shared/boot/signature/ed25519.hpp"

namespace flexspline::tests {

using Bytes32 = std::array<std::uint8_t, 32>;

inline std::vector<std::uint8_t> from_hex(std::string_view text) {
  const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(digit(text[i]) * 16 + digit(text[i + 1])));
  return bytes;
}
template <std::size_t n>
std::array<std::uint8_t, n> array_from_hex(std::string_view text) {
  std::array<std::uint8_t, n> bytes{};
  const auto read = from_hex(text);
  std::copy_n(read.begin(), std::min(n, read.size()), bytes.begin());
  return bytes;
}

// What a verification is asked.
struct SignatureCase {
  ed25519::PublicKey key{};
  ed25519::Signature signature{};
  std::vector<std::uint8_t> message;

  bool drive_accepts() const { return ed25519::verify(key, signature, message); }
  bool libsodium_accepts() const {
    return crypto_sign_verify_detached(signature.data(), message.data(), message.size(), key.data()) == 0;
  }
  void set_r(const Bytes32& r) { std::copy(r.begin(), r.end(), signature.begin()); }
  void set_s(const Bytes32& s) { std::copy(s.begin(), s.end(), signature.begin() + 32); }
};

// L of RFC 8032, the order of the base point.
inline const Bytes32 kGroupOrder =
    array_from_hex<32>("edd3f55c1a631258d69cf7a2def9de1400000000000000000000000000000010");
// The eight points whose order divides eight; then other encodings of some of them, with y not below p, or the sign of
// a zero.
inline const std::array<const char*, 14> kSmallOrder{
    "0100000000000000000000000000000000000000000000000000000000000000",
    "ecffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
    "0000000000000000000000000000000000000000000000000000000000000000",
    "0000000000000000000000000000000000000000000000000000000000000080",
    "26e8958fc2b227b045c3f489f2ef98f0d5dfac05d3c63339b13802886d53fc05",
    "26e8958fc2b227b045c3f489f2ef98f0d5dfac05d3c63339b13802886d53fc85",
    "c7176a703d4dd84fba3c0b760d10670f2a2053fa2c39ccc64ec7fd7792ac037a",
    "c7176a703d4dd84fba3c0b760d10670f2a2053fa2c39ccc64ec7fd7792ac03fa",
    "0100000000000000000000000000000000000000000000000000000000000080",
    "ecffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff",
    "edffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
    "edffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff",
    "eeffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
    "eeffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff"};

class SignatureCases {
 public:
  explicit SignatureCases(std::uint64_t seed) : random_(seed) {
    if (sodium_init() < 0) throw std::runtime_error("libsodium does not start");
  }

  SignatureCase good() {
    Bytes32 secret = bytes32();
    SignatureCase c;
    crypto_sign_seed_keypair(c.key.data(), both_.data(), secret.data());
    c.message.resize(random_() % 300);
    for (std::uint8_t& byte : c.message) byte = static_cast<std::uint8_t>(random_());
    crypto_sign_detached(c.signature.data(), nullptr, c.message.data(), c.message.size(), both_.data());
    return c;
  }
  // S + L, the same number modulo L.
  SignatureCase with_longer_s() {
    SignatureCase c = good();
    unsigned carry = 0;
    for (std::size_t i = 0; i < 32; ++i) {
      carry += unsigned{c.signature[32 + i]} + kGroupOrder[i];
      c.signature[32 + i] = static_cast<std::uint8_t>(carry);
      carry >>= 8;
    }
    return c;
  }
  // R is the neutral element or another encoding of it, and S = k a, so that S B - k A is the neutral element.
  SignatureCase with_r_of_small_order(std::string_view r) {
    SignatureCase c = good();
    c.set_r(array_from_hex<32>(r));
    Bytes32 s{};
    crypto_core_ed25519_scalar_mul(s.data(), number_k(c).data(), secret_number().data());
    c.set_s(s);
    return c;
  }
  // The key has a part of order eight: A + T. R - k T is R where eight divides k; the equation that is multiplied by
  // eight holds always.
  SignatureCase with_key_of_mixed_order() {
    SignatureCase c = good();
    const Bytes32 torsion = array_from_hex<32>(kSmallOrder[4 + random_() % 4]), a = secret_number(), r = below_order();
    ed25519::PublicKey mixed{};
    crypto_core_ed25519_add(mixed.data(), c.key.data(), torsion.data());
    c.key = mixed;
    Bytes32 point{}, s{};
    crypto_scalarmult_ed25519_base_noclamp(point.data(), r.data());
    c.set_r(point);
    crypto_core_ed25519_scalar_mul(s.data(), number_k(c).data(), a.data());
    crypto_core_ed25519_scalar_add(s.data(), s.data(), r.data());
    c.set_s(s);
    return c;
  }
  // A case of each kind in turn.
  SignatureCase next(std::size_t number, const char*& kind) {
    static constexpr const char* kKinds[] = {"good",
                                             "bit of R",
                                             "bit of S",
                                             "bit of A",
                                             "bit of M",
                                             "truncated M",
                                             "S + L",
                                             "random signature",
                                             "random key",
                                             "key of another",
                                             "R of small order",
                                             "A of small order",
                                             "R and S swapped",
                                             "S high",
                                             "R of order one",
                                             "A of mixed order"};
    kind = kKinds[number % std::size(kKinds)];
    const std::string_view what = kind;
    if (what == "S + L") return with_longer_s();
    if (what == "R of order one") return with_r_of_small_order(kSmallOrder[number / std::size(kKinds) % 14]);
    if (what == "A of mixed order") return with_key_of_mixed_order();
    SignatureCase c = good();
    if (what == "bit of R") flip(std::span(c.signature).first(32));
    if (what == "bit of S") flip(std::span(c.signature).last(32));
    if (what == "bit of A") flip(c.key);
    if (what == "bit of M") c.message.empty() ? c.message.push_back(0) : flip(c.message);
    if (what == "truncated M") c.message.empty() ? c.message.push_back(0) : c.message.pop_back();
    if (what == "random signature") c.set_r(bytes32()), c.set_s(below_order());
    if (what == "random key") c.key = bytes32();
    if (what == "key of another") c.key = good().key;
    if (what == "R of small order") c.set_r(array_from_hex<32>(kSmallOrder[random_() % 14]));
    if (what == "A of small order") c.key = array_from_hex<32>(kSmallOrder[random_() % 14]);
    if (what == "R and S swapped")
      std::swap_ranges(c.signature.begin(), c.signature.begin() + 32, c.signature.begin() + 32);
    if (what == "S high") c.signature[63] = static_cast<std::uint8_t>(c.signature[63] | 0x10 << random_() % 4);
    return c;
  }

 private:
  Bytes32 bytes32() {
    Bytes32 bytes{};
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_());
    return bytes;
  }
  void flip(std::span<std::uint8_t> bytes) {
    bytes[random_() % bytes.size()] ^= static_cast<std::uint8_t>(1 << random_() % 8);
  }
  Bytes32 below_order() {
    std::array<std::uint8_t, 64> long_number{};
    for (std::uint8_t& byte : long_number) byte = static_cast<std::uint8_t>(random_());
    Bytes32 number{};
    crypto_core_ed25519_scalar_reduce(number.data(), long_number.data());
    return number;
  }
  // k = SHA-512(R, A, M) modulo L.
  static Bytes32 number_k(const SignatureCase& c) {
    std::vector<std::uint8_t> all(c.signature.begin(), c.signature.begin() + 32);
    all.insert(all.end(), c.key.begin(), c.key.end());
    all.insert(all.end(), c.message.begin(), c.message.end());
    std::array<std::uint8_t, 64> hash{};
    crypto_hash_sha512(hash.data(), all.data(), all.size());
    Bytes32 number{};
    crypto_core_ed25519_scalar_reduce(number.data(), hash.data());
    return number;
  }
  // Of the last key: RFC 8032, 5.1.5; modulo L.
  Bytes32 secret_number() const {
    std::array<std::uint8_t, 64> hash{};
    crypto_hash_sha512(hash.data(), both_.data(), 32);
    hash[0] &= 0xF8;
    hash[31] = static_cast<std::uint8_t>((hash[31] & 0x7F) | 0x40);
    std::fill(hash.begin() + 32, hash.end(), std::uint8_t{0});
    Bytes32 number{};
    crypto_core_ed25519_scalar_reduce(number.data(), hash.data());
    return number;
  }

  std::mt19937_64 random_;
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> both_{};
};

// Accepted and refused, by kind; `differ`: where the drive and libsodium judge differently.
struct Agreement {
  std::map<std::string, std::array<std::size_t, 2>> by_kind;
  std::vector<std::string> differ;
};
inline Agreement agreement_with_libsodium(std::size_t count, std::uint64_t seed) {
  SignatureCases cases(seed);
  Agreement result;
  for (std::size_t i = 0; i < count; ++i) {
    const char* kind = nullptr;
    const SignatureCase c = cases.next(i, kind);
    const bool accepted = c.drive_accepts();
    if (accepted != c.libsodium_accepts()) result.differ.push_back(kind + (" " + std::to_string(i)));
    ++result.by_kind[kind][accepted ? 0 : 1];
  }
  return result;
}

}  // namespace flexspline::tests
