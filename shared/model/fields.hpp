// The fields of a parameter block. A struct lists its fields in `fields(codec)`, in the order of the block, which is
// not that of its members: `c(torque), c.limit(most)`. This file has what a field can be, with its bounds, and the two
// codecs: FieldReader checks and reads, FieldWriter (host) writes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "shared/effects/variables.hpp"
#include "shared/fixed/derived_fields.hpp"
#include "shared/fixed/types.hpp"
#include "shared/model/encoding.hpp"

namespace flexspline::model {

enum class Field : std::uint8_t {
  // Integers within bounds.
  word,          // a raw number; the least has no magnitude, so it is none
  positive,      // a value above zero
  limit,         // a value above zero, up to two bases
  unsigned_one,  // a value from zero to one base
  order,         // cycles a turn
  share,         // from zero to next to one
  wide,          // a state or a distance
  position,      // in 2^-32 turns
  speed,         // in 2^-48 turns a tick, above zero and below half a turn
  factor,        // from zero to 2^50
  number,        // any of 32 bits
  flag,
  variable,
  balance,
  shape,      // of an excitation
  lines,      // of an excitation
  harmonics,  // cycles of a line
  counts,     // of an encoder, a turn
  tick_rate,  // up to 2^20 a second
  ticks,      // at least one
  ticks_or_none,
  short_ticks,  // at least one, in 16 bits
  short_ticks_or_none,
  share_of_converter,  // 2^-15
  // With more in memory than in a block: what follows from these (fixed::derive_fields).
  gain,
  step_gain,
  ratio_gain,
  distance_gain,
  harmonic,
  points  // a number of words and so many words
};

// As many bytes in a block, four or eight. Zero to 2^bits - below, from `low` on.
struct IntegerField {
  std::uint8_t bytes;
  std::int8_t low;
  std::uint8_t bits;
  std::uint8_t below;
};
inline constexpr std::int8_t kMirrored = -128;  // the low bound is the high one below zero
inline constexpr IntegerField kIntegers[] = {
    {4, kMirrored, 31, 1},  // word
    {4, 1, 31, 1},          // positive
    {4, 1, 28, 0},          // limit
    {4, 0, 27, 0},          // unsigned_one
    {8, kMirrored, 62, 1},  // order
    {8, 0, 63, 1},          // share
    {8, kMirrored, 63, 1},  // wide
    {8, kMirrored, 62, 0},  // position
    {8, 1, 47, 1},          // speed
    {8, 0, 50, 0},          // factor
    {4, 0, 32, 1},          // number
    {4, 0, 1, 1},           // flag
    {4, 0, 4, 4},           // variable
    {4, 0, 2, 2},           // balance
    {4, 0, 3, 4},           // shape
    {4, 0, 5, 0},           // lines
    {4, 0, 15, 1},          // harmonics
    {4, 4, 24, 0},          // counts
    {4, 1, 20, 0},          // tick_rate
    {4, 1, 31, 1},          // ticks
    {4, 0, 31, 1},          // ticks_or_none
    {4, 1, 16, 1},          // short_ticks
    {4, 0, 16, 1},          // short_ticks_or_none
    {4, kMirrored, 15, 1},  // share_of_converter
};
static_assert(std::size(kIntegers) == static_cast<std::size_t>(Field::gain));
static_assert(static_cast<int>(effects::Variable::temperature) == 12 && static_cast<int>(effects::Balance::load) == 2);

constexpr std::int64_t highest(const IntegerField& f) {
  return static_cast<std::int64_t>((std::uint64_t{1} << f.bits) - f.below);
}
constexpr std::int64_t lowest(const IntegerField& f) {
  return f.low == kMirrored ? -highest(f) : f.low;
}

inline constexpr std::size_t kMostPoints = 256;

// What fields() calls, for a codec that has integer(Field, member), floating(Field, member), harmonic(member) and
// points(number, words). A member is listed by its type, or by a name where its bounds are narrower than its type.
template <class Codec>
class FieldNames {
 public:
  constexpr void operator()(fixed::Value& x) { integer(Field::word, x.raw); }
  constexpr void operator()(fixed::Weight& x) { integer(Field::word, x.raw); }
  constexpr void operator()(fixed::Exponent& x) { integer(Field::word, x.raw); }
  constexpr void operator()(fixed::Order& x) { integer(Field::order, x.raw); }
  constexpr void operator()(fixed::Share& x) { integer(Field::share, x.raw); }
  constexpr void operator()(fixed::State& x) { integer(Field::wide, x.raw); }
  constexpr void operator()(fixed::Step& x) { integer(Field::wide, x.raw); }
  constexpr void operator()(bool& x) { integer(Field::flag, x); }
  constexpr void operator()(effects::Variable& x) { integer(Field::variable, x); }
  constexpr void operator()(effects::Balance& x) { integer(Field::balance, x); }
  constexpr void operator()(fixed::Gain& x) { codec().floating(Field::gain, x); }
  constexpr void operator()(fixed::StepGain& x) { codec().floating(Field::step_gain, x); }
  constexpr void operator()(fixed::RatioGain& x) { codec().floating(Field::ratio_gain, x); }
  constexpr void operator()(fixed::DistanceGain& x) { codec().floating(Field::distance_gain, x); }
  constexpr void operator()(fixed::Harmonic& x) { codec().harmonic(x); }
  template <class T, std::size_t Size>
  constexpr void operator()(std::array<T, Size>& all) {
    for (T& x : all) (*this)(x);
  }
  template <class T>
  requires requires(T& x, Codec& c) { x.fields(c); }
  constexpr void operator()(T& x) { x.fields(codec()); }
  constexpr void positive(fixed::Value& x) { integer(Field::positive, x.raw); }
  constexpr void positive(std::int32_t& x) { integer(Field::positive, x); }
  constexpr void signed_word(std::int32_t& x) { integer(Field::word, x); }
  constexpr void limit(fixed::Value& x) { integer(Field::limit, x.raw); }
  constexpr void unsigned_one(fixed::Value& x) { integer(Field::unsigned_one, x.raw); }
  constexpr void share(std::uint64_t& x) { integer(Field::share, x); }
  constexpr void wide(std::uint64_t& x) { integer(Field::wide, x); }
  constexpr void position(std::int64_t& x) { integer(Field::position, x); }
  constexpr void speed(std::int64_t& x) { integer(Field::speed, x); }
  constexpr void factor(std::int64_t& x) { integer(Field::factor, x); }
  constexpr void number(std::uint32_t& x) { integer(Field::number, x); }
  template <class Shape>
  constexpr void shape(Shape& x) {
    integer(Field::shape, x);
  }
  constexpr void lines(std::uint8_t& x) { integer(Field::lines, x); }
  constexpr void harmonics(std::uint16_t& x) { integer(Field::harmonics, x); }
  constexpr void counts(std::uint32_t& x) { integer(Field::counts, x); }
  constexpr void tick_rate(std::uint32_t& x) { integer(Field::tick_rate, x); }
  template <class Ticks>
  constexpr void ticks(Ticks& x) {
    integer(Field::ticks, x);
  }
  template <class Ticks>
  constexpr void ticks_or_none(Ticks& x) {
    integer(Field::ticks_or_none, x);
  }
  constexpr void short_ticks(std::uint16_t& x) { integer(Field::short_ticks, x); }
  constexpr void short_ticks_or_none(std::uint16_t& x) { integer(Field::short_ticks_or_none, x); }
  constexpr void share_of_converter(std::int16_t& x) { integer(Field::share_of_converter, x); }

 private:
  constexpr Codec& codec() { return static_cast<Codec&>(*this); }
  template <class Member>
  constexpr void integer(Field field, Member& member) {
    codec().integer(field, member);
  }
};

// Where fields are wrong.
enum class FieldFault : std::uint8_t { none, length, field };
struct FieldVerdict {
  FieldFault fault = FieldFault::none;
  std::int16_t field = -1;  // from zero
};

namespace detail {
inline std::uint32_t word_at(const std::uint8_t* from) {
  std::uint32_t bits;
  std::memcpy(&bits, from, sizeof(bits));
  return bits;
}
// Mantissa 2^(exponent - 30), the mantissa within a factor of two.
constexpr bool normal(std::int32_t mantissa, std::int32_t exponent, std::int32_t least, std::int32_t most) {
  if (mantissa == 0) return exponent == 0;
  const std::int64_t size = mantissa < 0 ? -std::int64_t{mantissa} : mantissa;
  return size >= (std::int64_t{1} << (fixed::kMantissaBits - 1)) && size <= (std::int64_t{1} << fixed::kMantissaBits) &&
         exponent >= least && exponent <= most;
}
}  // namespace detail

// Reads the fields of an entry. After the first that is wrong, members are zero: nothing is to be done with them. The
// functions that are not templates are not inlined: so a field takes a drive a call.
class FieldReader : public FieldNames<FieldReader> {
 public:
  explicit FieldReader(std::span<const std::uint8_t> bytes) : from_(bytes.data()), left_(bytes.size()) {}
  std::size_t left() const { return left_; }
  bool good() const { return fault_ == FieldFault::none; }
  // Of an entry that is not read.
  void skip() { left_ = 0; }
  // After the last field. All bytes have to be of fields.
  FieldVerdict verdict() const {
    if (good()) return left_ == 0 ? FieldVerdict{} : FieldVerdict{FieldFault::length, -1};
    return {fault_, fault_ == FieldFault::field ? number_ : std::int16_t{-1}};
  }

  template <class Member>
  void integer(Field field, Member& member) {
    member = static_cast<Member>(next(kIntegers[static_cast<std::size_t>(field)]));
  }
  template <class Gain>
  [[gnu::noinline]] void floating(Field, Gain& x) {
    x = {};
    if (!has(8)) return;
    const auto mantissa = static_cast<std::int32_t>(word()), exponent = static_cast<std::int32_t>(word());
    if (!detail::normal(mantissa, exponent, Gain::kLeastExponent, Gain::kMostExponent)) return fail();
    x.mantissa = mantissa;
    x.exponent = static_cast<std::int8_t>(exponent);
    if (!fixed::derive_fields(x)) return fail();
    ++number_;
  }
  [[gnu::noinline]] void harmonic(fixed::Harmonic& x) {
    x = {};
    if (!has(16)) return;
    const std::uint32_t low = word();
    x.order = static_cast<std::int64_t>((std::uint64_t{word()} << 32) | low);
    x.phase = word();
    x.amplitude = static_cast<std::int32_t>(word());
    if (!fixed::derive_fields(x)) return fail();
    ++number_;
  }
  template <class Word, std::size_t Size>
  void points(std::int16_t& count, std::array<Word, Size>& words) {
    count = 0;
    if (!has(4)) return;
    const std::uint32_t stated = word();
    if (stated < 2 || stated > Size) return fail();
    if (!has(4 * std::size_t{stated})) return;
    count = static_cast<std::int16_t>(stated);
    const std::int16_t number = ++number_;  // all points are one field
    for (std::size_t i = 0; i < stated; ++i) {
      (*this)(words[i]);
      if (!good()) return;
      number_ = number;
    }
  }

 private:
  bool has(std::size_t bytes) {
    if (!good()) return false;
    if (left_ >= bytes) return true;
    fault_ = FieldFault::length;
    return false;
  }
  void fail() { fault_ = FieldFault::field; }
  std::uint32_t word() {
    const std::uint32_t bits = detail::word_at(from_);
    from_ += 4;
    left_ -= 4;
    return bits;
  }
  [[gnu::noinline]] std::int64_t next(const IntegerField& f) {
    if (!has(f.bytes)) return 0;
    const std::uint32_t low = word();
    const std::uint32_t high = f.bytes == 8         ? word()
                               : f.low == kMirrored ? static_cast<std::uint32_t>(static_cast<std::int32_t>(low) >> 31)
                                                    : 0;
    const auto x = static_cast<std::int64_t>((std::uint64_t{high} << 32) | low);
    if (x < lowest(f) || x > highest(f)) {
      fail();
      return 0;
    }
    ++number_;
    return x;
  }

  const std::uint8_t* from_;
  std::size_t left_;
  std::int16_t number_ = 0;
  FieldFault fault_ = FieldFault::none;
};

// Host only: writes what FieldReader reads.
class FieldWriter : public FieldNames<FieldWriter> {
 public:
  explicit constexpr FieldWriter(Writer& writer) : writer_(writer) {}
  template <class Member>
  constexpr void integer(Field field, Member& member) {
    const auto x = static_cast<std::int64_t>(member);
    if (kIntegers[static_cast<std::size_t>(field)].bytes == 8) {
      writer_.put(x);
    } else {
      writer_.put(static_cast<std::int32_t>(x));
    }
  }
  template <class Gain>
  constexpr void floating(Field, Gain& x) {
    writer_.put(x.mantissa);
    writer_.put(std::int32_t{x.exponent});
  }
  constexpr void harmonic(fixed::Harmonic& x) {
    writer_.put(x.order);
    writer_.put(x.phase);
    writer_.put(x.amplitude);
  }
  template <class Word, std::size_t Size>
  constexpr void points(std::int16_t& count, std::array<Word, Size>& words) {
    writer_.put(std::int32_t{count});
    for (std::int16_t i = 0; i < count; ++i) (*this)(words[static_cast<std::size_t>(i)]);
  }

 private:
  Writer& writer_;
};

// Reads the fields of a struct from an entry that holds nothing else.
template <class T>
FieldVerdict read_fields(std::span<const std::uint8_t> bytes, T& object) {
  FieldReader reader(bytes);
  object.fields(reader);
  return reader.verdict();
}
// Host only: writes those of `object`, which fields() does not change.
template <class T>
constexpr void write_fields(Writer& writer, T object) {
  FieldWriter codec(writer);
  object.fields(codec);
}

}  // namespace flexspline::model
