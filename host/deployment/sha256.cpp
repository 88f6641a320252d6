#include "host/deployment/sha256.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <vector>

namespace flexspline::deployment {
namespace {

using Words = std::array<std::uint32_t, 8>;

constexpr std::array<std::uint32_t, 64> kPrimes = [] {
  std::array<std::uint32_t, 64> primes{};
  std::size_t found = 0;
  for (std::uint32_t n = 2; found < primes.size(); ++n) {
    bool prime = true;
    for (std::size_t i = 0; i < found; ++i) prime = prime && n % primes[i] != 0;
    if (prime) primes[found++] = n;
  }
  return primes;
}();
// The first 32 bits of the fraction of a root, by whole numbers: the root of n 2^(32 k) rounded down.
std::uint32_t square_root_fraction(std::uint32_t n) {
  auto root = static_cast<std::uint64_t>(std::sqrt(static_cast<long double>(n)) * 0x1p32L);
  return static_cast<std::uint32_t>(root);
}
std::uint32_t cube_root_fraction(std::uint32_t n) {
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(std::cbrt(static_cast<long double>(n)) * 0x1p32L));
}

void take(Words& state, const std::uint8_t* block) {
  static const std::array<std::uint32_t, 64> kConstants = [] {
    std::array<std::uint32_t, 64> k{};
    for (std::size_t i = 0; i < k.size(); ++i) k[i] = cube_root_fraction(kPrimes[i]);
    return k;
  }();
  std::array<std::uint32_t, 64> w{};
  for (std::size_t i = 0; i < 16; ++i)
    for (std::size_t b = 0; b < 4; ++b) w[i] = (w[i] << 8) | block[4 * i + b];
  for (std::size_t i = 16; i < 64; ++i) {
    const std::uint32_t a = w[i - 15], b = w[i - 2];
    w[i] = w[i - 16] + w[i - 7] + (std::rotr(a, 7) ^ std::rotr(a, 18) ^ (a >> 3)) +
           (std::rotr(b, 17) ^ std::rotr(b, 19) ^ (b >> 10));
  }
  Words s = state;
  for (std::size_t i = 0; i < 64; ++i) {
    const std::uint32_t choice = (s[4] & s[5]) ^ (~s[4] & s[6]);
    const std::uint32_t most = (s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]);
    const std::uint32_t one =
        s[7] + (std::rotr(s[4], 6) ^ std::rotr(s[4], 11) ^ std::rotr(s[4], 25)) + choice + kConstants[i] + w[i];
    const std::uint32_t two = (std::rotr(s[0], 2) ^ std::rotr(s[0], 13) ^ std::rotr(s[0], 22)) + most;
    s = {one + two, s[0], s[1], s[2], s[3] + one, s[4], s[5], s[6]};
  }
  for (std::size_t i = 0; i < s.size(); ++i) state[i] += s[i];
}

}  // namespace

std::string sha256(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kBlock = 64;
  std::vector<std::uint8_t> all(bytes.begin(), bytes.end());
  all.push_back(0x80);
  while (all.size() % kBlock != kBlock - 8) all.push_back(0);
  const std::uint64_t bits = 8 * static_cast<std::uint64_t>(bytes.size());
  for (int shift = 56; shift >= 0; shift -= 8) all.push_back(static_cast<std::uint8_t>(bits >> shift));
  Words state{};
  for (std::size_t i = 0; i < state.size(); ++i) state[i] = square_root_fraction(kPrimes[i]);
  for (std::size_t at = 0; at < all.size(); at += kBlock) take(state, all.data() + at);
  std::string text;
  for (const std::uint32_t word : state) text += fmt::format("{:08x}", word);
  return text;
}

}  // namespace flexspline::deployment
