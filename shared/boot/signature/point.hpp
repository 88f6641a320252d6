// Points of edwards25519 (RFC 8032, 5.1): -x^2 + y^2 = 1 + d x^2 y^2 modulo p, in extended coordinates with x = X / Z,
// y = Y / Z, x y = T / Z.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "shared/boot/signature/field.hpp"

namespace flexspline::ed25519 {

inline constexpr Field kOne{{1}};
inline constexpr Field kCurveD{
    {0x135978a3, 0x75eb4dca, 0x4141d8ab, 0x00700a4d, 0x7779e898, 0x8cc74079, 0x2b6ffe73, 0x52036cee}};
// 2^((p - 1) / 4).
inline constexpr Field kRootOfMinusOne{
    {0x4a0ea0b0, 0xc4ee1b27, 0xad2fe478, 0x2f431806, 0x3dfbd7a7, 0x2b4d0099, 0x4fc1df0b, 0x2b832480}};

struct Point {
  Field x{}, y = kOne, z = kOne, t{};  // the neutral element

  // 5.1.4. Complete: valid for any two points of the curve.
  friend constexpr Point operator+(const Point& p, const Point& q) {
    const Field a = (p.y - p.x) * (q.y - q.x), b = (p.y + p.x) * (q.y + q.x);
    const Field c = p.t * q.t * (kCurveD + kCurveD), zz = p.z * q.z;
    return combined(b - a, zz + zz - c, zz + zz + c, b + a);
  }
  // 5.1.4, for two equal ones.
  constexpr Point doubled() const {
    const Field a = x * x, b = y * y, zz = z * z, sum = x + y;
    const Field h = a + b, g = a - b;
    return combined(h - sum * sum, zz + zz + g, g, h);
  }
  constexpr Point negative() const { return {Field{} - x, y, z, Field{} - t}; }
  // Its order divides eight.
  constexpr bool has_small_order() const {
    const Point eightfold = doubled().doubled().doubled();
    return eightfold.x.is_zero() && eightfold.y == eightfold.z;
  }
  // 5.1.2.
  constexpr std::array<std::uint8_t, 32> encoded() const {
    const Field inverse = z.inverse();
    Words words = (y * inverse).canonical();
    if ((x * inverse).is_odd()) words[7] |= 0x80000000;
    return bytes_of(words);
  }

 private:
  static constexpr Point combined(const Field& e, const Field& f, const Field& g, const Field& h) {
    return {e * f, g * h, f * g, e * h};
  }
};

// B (5.1, table 1).
inline constexpr Field kBaseX{
    {0x8f25d51a, 0xc9562d60, 0x9525a7b2, 0x692cc760, 0xfdd6dc5c, 0xc0a4e231, 0xcd6e53fe, 0x216936d3}};
inline constexpr Field kBaseY{
    {0x66666658, 0x66666666, 0x66666666, 0x66666666, 0x66666666, 0x66666666, 0x66666666, 0x66666666}};

// 5.1.3. False: it is no point of the curve, or not the canonical encoding of one.
constexpr bool decode(std::span<const std::uint8_t, 32> bytes, Point& point) {
  Field y{words_of(bytes)};
  const bool odd = (y.words[7] >> 31) != 0;
  y.words[7] &= 0x7FFFFFFF;
  if (!is_less(y.words, Field::kPrime)) return false;
  // x^2 = u / v; a candidate for x is u v^3 (u v^7)^((p - 5) / 8).
  const Field yy = y * y, u = yy - kOne, v = kCurveD * yy + kOne;
  const Field uv3 = u * v * v * v;
  Field x = uv3 * (uv3 * v.squared(2)).root_power();
  const Field vxx = v * x * x;
  if (!(vxx == u)) {
    if (!(vxx + u).is_zero()) return false;
    x = x * kRootOfMinusOne;
  }
  if (odd && x.is_zero()) return false;
  if (x.is_odd() != odd) x = Field{} - x;
  point = {x, y, kOne, x * y};
  return true;
}

}  // namespace flexspline::ed25519
