// How numbers stand in a parameter block: little-endian, fixed width, each by its kind and with its bounds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "shared/fixed/complete.hpp"
#include "shared/fixed/types.hpp"
#include "shared/model/fields.hpp"

namespace flexspline::model {

// CRC-32 as in IEEE 802.3 (reflected, 0xEDB88320), by half-bytes: a table of 64 bytes.
constexpr std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  constexpr std::uint32_t kTable[16] = {0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4,
                                        0x4DB26158, 0x5005713C, 0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C,
                                        0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C};
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) {
    crc = kTable[(crc ^ byte) & 15] ^ (crc >> 4);
    crc = kTable[(crc ^ (byte >> 4)) & 15] ^ (crc >> 4);
  }
  return ~crc;
}

// Writes as far as there is room and counts what there is to write.
class Writer {
 public:
  explicit constexpr Writer(std::span<std::uint8_t> room) : room_(room) {}
  template <class T>
  constexpr void put(T number) {
    auto bits = static_cast<std::uint64_t>(number);
    for (std::size_t i = 0; i < sizeof(T); ++i, bits >>= 8) {
      if (at_ < room_.size()) room_[at_] = static_cast<std::uint8_t>(bits);
      ++at_;
    }
  }
  constexpr std::size_t size() const { return at_; }
  constexpr bool fits() const { return at_ <= room_.size(); }

 private:
  std::span<std::uint8_t> room_;
  std::size_t at_ = 0;
};

// Reads noughts beyond the end, and then is no longer whole.
class Reader {
 public:
  explicit constexpr Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  template <class T>
  constexpr T take() {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i, ++at_)
      if (at_ < bytes_.size()) bits |= std::uint64_t{bytes_[at_]} << (8 * i);
    return static_cast<T>(bits);
  }
  constexpr std::size_t left() const { return at_ < bytes_.size() ? bytes_.size() - at_ : 0; }
  constexpr bool whole() const { return at_ <= bytes_.size(); }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

// A number of any size, for what the drive does not compute with: mantissa 2^(exponent - 30).
struct Number {
  std::int32_t mantissa = 0;
  std::int32_t exponent = 0;
};

// Encoding<T>: put(Writer&, x), and take(Reader&, x), which returns whether what it read is within the bounds of a T.
template <class T>
struct Encoding;

template <class T>
requires std::is_integral_v<T>
struct Encoding<T> {
  static constexpr void put(Writer& w, T x) { w.put(x); }
  static constexpr bool take(Reader& r, T& x) {
    x = r.take<T>();
    return true;
  }
};
template <>
struct Encoding<bool> {
  static constexpr void put(Writer& w, bool x) { w.put(std::uint32_t{x}); }
  static constexpr bool take(Reader& r, bool& x) {
    const auto bits = r.take<std::uint32_t>();
    x = bits != 0;
    return bits <= 1;
  }
};
template <class T, std::size_t Size>
struct Encoding<std::array<T, Size>> {
  static constexpr void put(Writer& w, const std::array<T, Size>& x) {
    for (const T& one : x) Encoding<T>::put(w, one);
  }
  static constexpr bool take(Reader& r, std::array<T, Size>& x) {
    bool good = true;
    for (T& one : x) good = Encoding<T>::take(r, one) && good;
    return good;
  }
};

namespace detail {
// A raw number within -2^31+1 and 2^31-1: every format but the least number, whose magnitude has none.
template <class T>
struct OneWord {
  static constexpr void put(Writer& w, const T& x) { w.put(x.raw); }
  static constexpr bool take(Reader& r, T& x) {
    x.raw = r.take<std::int32_t>();
    return x.raw != INT32_MIN;
  }
};
constexpr bool normal(std::int32_t mantissa, std::int32_t exponent, std::int32_t least, std::int32_t most) {
  if (mantissa == 0) return exponent == 0;
  const std::int64_t size = mantissa < 0 ? -std::int64_t{mantissa} : mantissa;
  return size >= (std::int64_t{1} << (fixed::kMantissaBits - 1)) && size <= (std::int64_t{1} << fixed::kMantissaBits) &&
         exponent >= least && exponent <= most;
}
// Mantissa and exponent; what else the drive keeps with them follows from these (fixed::completed).
template <class T>
struct Floating {
  static constexpr void put(Writer& w, const T& x) {
    w.put(x.mantissa);
    w.put(std::int32_t{x.exponent});
  }
  static constexpr bool take(Reader& r, T& x) {
    x = T{};
    x.mantissa = r.take<std::int32_t>();
    const auto exponent = r.take<std::int32_t>();
    if (!normal(x.mantissa, exponent, T::kLeastExponent, T::kMostExponent)) return false;
    x.exponent = static_cast<std::int8_t>(exponent);
    return fixed::complete(x);
  }
};
template <class T>
inline constexpr bool HasFormat = false;
template <class T, std::size_t Size>
inline constexpr bool HasFormat<std::array<T, Size>> = true;
template <>
inline constexpr bool HasFormat<Number> = true;
template <class T>
requires(std::is_base_of_v<fixed::Value, T> || std::is_base_of_v<fixed::Exponent, T> ||
         std::is_base_of_v<fixed::Weight, T> || std::is_base_of_v<fixed::Harmonic, T> ||
         std::is_base_of_v<fixed::Gain, T> || std::is_base_of_v<fixed::StepGain, T> ||
         std::is_base_of_v<fixed::RatioGain, T> || std::is_base_of_v<fixed::DistanceGain, T> ||
         std::is_base_of_v<fixed::Order, T> || std::is_base_of_v<fixed::Share, T> ||
         std::is_base_of_v<fixed::Weight, T> || std::is_base_of_v<fixed::Harmonic, T> ||
         std::is_base_of_v<fixed::State, T> ||
         std::is_base_of_v<fixed::Step, T>) inline constexpr bool HasFormat<T> = true;
}  // namespace detail

template <class T>
requires std::is_base_of_v<fixed::Value, T>
struct Encoding<T> : detail::OneWord<T> {
};
template <class T>
requires std::is_base_of_v<fixed::Exponent, T>
struct Encoding<T> : detail::OneWord<T> {
};
template <class T>
requires(std::is_base_of_v<fixed::Gain, T> || std::is_base_of_v<fixed::StepGain, T> ||
         std::is_base_of_v<fixed::RatioGain, T> ||
         std::is_base_of_v<fixed::DistanceGain, T>) struct Encoding<T> : detail::Floating<T> {
};

template <class T>
requires std::is_base_of_v<fixed::Weight, T>
struct Encoding<T> : detail::OneWord<T> {
};
template <class T>
requires std::is_base_of_v<fixed::Harmonic, T>
struct Encoding<T> {
  static constexpr void put(Writer& w, const T& x) {
    w.put(x.order);
    w.put(x.phase);
    w.put(x.amplitude);
  }
  static constexpr bool take(Reader& r, T& x) {
    x.order = r.take<std::int64_t>();
    x.phase = r.take<std::uint32_t>();
    x.amplitude = r.take<std::int32_t>();
    return fixed::complete(x);
  }
};

template <>
struct Encoding<Number> {
  static constexpr void put(Writer& w, const Number& x) {
    w.put(x.mantissa);
    w.put(x.exponent);
  }
  static constexpr bool take(Reader& r, Number& x) {
    x.mantissa = r.take<std::int32_t>();
    x.exponent = r.take<std::int32_t>();
    return detail::normal(x.mantissa, x.exponent, -100, 100);
  }
};
template <class T>
requires std::is_base_of_v<fixed::Order, T>
struct Encoding<T> {
  static constexpr void put(Writer& w, const T& x) { w.put(x.raw); }
  static constexpr bool take(Reader& r, T& x) {
    constexpr std::int64_t kMost = std::int64_t{1} << 62;
    x.raw = r.take<std::int64_t>();
    return x.raw > -kMost && x.raw < kMost;
  }
};
template <class T>
requires std::is_base_of_v<fixed::Share, T>
struct Encoding<T> {
  static constexpr void put(Writer& w, const T& x) { w.put(x.raw); }
  static constexpr bool take(Reader& r, T& x) {
    x.raw = r.take<std::uint64_t>();
    return x.raw < (std::uint64_t{1} << fixed::kShareBits);
  }
};
template <class T>
requires(std::is_base_of_v<fixed::State, T> || std::is_base_of_v<fixed::Step, T>) struct Encoding<T> {
  static constexpr void put(Writer& w, const T& x) { w.put(x.raw); }
  static constexpr bool take(Reader& r, T& x) {
    x.raw = r.take<std::int64_t>();
    return x.raw != INT64_MIN;
  }
};
// Coefficients that are not plain members in a row, as those of a table with its number of points, say so themselves by
//   template <class Codec> constexpr bool fields(Codec& codec)
// which is run for both directions: codec(x) for a coefficient, codec.bounded(n, low, high) for an integer or an
// enumeration, codec.list(elements, count, least) for the first `count` elements of an array, at least `least`. Each
// returns whether it is within its bounds.
class PuttingCodec {
 public:
  explicit constexpr PuttingCodec(Writer& w) : writer_(w) {}
  template <class T>
  constexpr bool operator()(T& x);
  template <class T>
  constexpr bool bounded(T& x, std::int32_t, std::int32_t) {
    writer_.put(static_cast<std::int32_t>(x));
    return true;
  }
  template <class Elements, class Count>
  constexpr bool list(Elements& elements, Count& count, std::int32_t) {
    writer_.put(static_cast<std::int32_t>(count));
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(count); ++i) (*this)(elements[static_cast<std::size_t>(i)]);
    return true;
  }

 private:
  Writer& writer_;
};
class TakingCodec {
 public:
  explicit constexpr TakingCodec(Reader& r) : reader_(r) {}
  template <class T>
  constexpr bool operator()(T& x);
  template <class T>
  constexpr bool bounded(T& x, std::int32_t low, std::int32_t high) {
    const auto n = reader_.take<std::int32_t>();
    if (n < low || n > high) return false;
    x = static_cast<T>(n);
    return true;
  }
  template <class Elements, class Count>
  constexpr bool list(Elements& elements, Count& count, std::int32_t least) {
    if (!bounded(count, least, static_cast<std::int32_t>(elements.size()))) return false;
    bool good = true;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(count); ++i)
      good = (*this)(elements[static_cast<std::size_t>(i)]) && good;
    return good;
  }

 private:
  Reader& reader_;
};
template <class T>
concept HasFields = requires(T& x, TakingCodec& codec) {
  x.fields(codec);
};

// Everything else is made of members that have an encoding.
template <class T>
requires(std::is_class_v<T>&& std::is_aggregate_v<T> && !detail::HasFormat<T>) struct Encoding<T> {
  static constexpr void put(Writer& w, const T& x) {
    if constexpr (HasFields<T>) {
      PuttingCodec codec(w);
      T copy = x;
      copy.fields(codec);
    } else {
      for_each_member(x, [&]<class M>(const M& member) { Encoding<M>::put(w, member); });
    }
  }
  static constexpr bool take(Reader& r, T& x) {
    if constexpr (HasFields<T>) {
      TakingCodec codec(r);
      return x.fields(codec);
    } else {
      bool good = true;
      for_each_member(x, [&]<class M>(M& member) { good = Encoding<M>::take(r, member) && good; });
      return good;
    }
  }
};

template <class T>
constexpr bool PuttingCodec::operator()(T& x) {
  Encoding<T>::put(writer_, x);
  return true;
}
template <class T>
constexpr bool TakingCodec::operator()(T& x) {
  return Encoding<T>::take(reader_, x);
}

}  // namespace flexspline::model
