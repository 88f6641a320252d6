// What coefficients look like in a block and in memory, as rows of bytes: each byte is a kind of field and how often it
// stands in a row. The rows of effects follow from the declaration of their coefficients, so that an effect's header is
// all there is of it; one routine reads them all, which a drive has room for where a routine for each it has not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "shared/effects/variables.hpp"
#include "shared/fixed/complete.hpp"
#include "shared/fixed/types.hpp"
#include "shared/model/encoding.hpp"
#include "shared/model/fields.hpp"

namespace flexspline::model {

enum class Field : std::uint8_t {
  end,  // of a row
  // Integers within bounds.
  word,          // a raw number; the least has no magnitude, so it is none
  positive,      // a value above nought
  limit,         // a value above nought, up to two bases
  unsigned_one,  // a value from nought to one base
  order,         // cycles a turn
  share,         // from nought to next to one
  wide,          // a state or a distance
  position,      // in 2^-32 turns
  speed,         // in 2^-48 turns a tick, above nought and below half a turn
  factor,        // from nought to 2^50
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
  // With more in memory than in a block: what follows from these (fixed::complete).
  gain,
  step_gain,
  ratio_gain,
  distance_gain,
  harmonic,
  points,  // a number of words and so many words
  kinds
};
static_assert(static_cast<int>(Field::kinds) <= 32);

// As many bytes in memory; in a block at least four. Nought to 2^bits - below, from `low` on.
struct IntegerField {
  std::uint8_t bytes;
  std::int8_t low;
  std::uint8_t bits;
  std::uint8_t below;
};
inline constexpr std::int8_t kMirrored = -128;  // the low bound is the high one below nought
inline constexpr IntegerField kIntegers[] = {
    {0, 0, 0, 0},           // end
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
    {1, 0, 1, 1},           // flag
    {1, 0, 4, 4},           // variable
    {1, 0, 2, 2},           // balance
    {1, 0, 3, 4},           // shape
    {1, 0, 5, 0},           // lines
    {2, 0, 15, 1},          // harmonics
    {4, 4, 24, 0},          // counts
    {4, 1, 20, 0},          // tick_rate
    {4, 1, 31, 1},          // ticks
    {4, 0, 31, 1},          // ticks_or_none
    {2, 1, 16, 1},          // short_ticks
    {2, 0, 16, 1},          // short_ticks_or_none
    {2, kMirrored, 15, 1},  // share_of_converter
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

// A row in one byte for up to eight fields of a kind.
inline constexpr int kFieldBits = 5;
constexpr Field field_of(std::uint8_t part) {
  return static_cast<Field>(part & ((1U << kFieldBits) - 1));
}
constexpr int often(std::uint8_t part) {
  return (part >> kFieldBits) + 1;
}

// How a row is written down when it is made: `Row row; row.add(Field::gain, 2);`
struct Row {
  std::array<std::uint8_t, 48> parts{};  // the last one an end
  std::size_t size = 0;
  constexpr Row& add(Field field, int times = 1) {
    for (int k = 0; k < times; ++k) {
      if (size > 0 && field_of(parts[size - 1]) == field && often(parts[size - 1]) < 8) {
        parts[size - 1] = static_cast<std::uint8_t>(parts[size - 1] + (1U << kFieldBits));
      } else {
        parts[size++] = static_cast<std::uint8_t>(field);
      }
    }
    return *this;
  }
  constexpr Row& add(const Row& other) {
    for (std::size_t i = 0; i < other.size; ++i) add(field_of(other.parts[i]), often(other.parts[i]));
    return *this;
  }
};

namespace detail {
struct Size {
  std::uint8_t bytes;
  std::uint8_t align;
  std::uint8_t in_block;
};
template <class T>
inline constexpr Size kSizeOf{sizeof(T), alignof(T), 8};
inline constexpr Size kSizes[] = {kSizeOf<fixed::Gain>,
                                  kSizeOf<fixed::StepGain>,
                                  kSizeOf<fixed::RatioGain>,
                                  kSizeOf<fixed::DistanceGain>,
                                  {sizeof(fixed::Harmonic), alignof(fixed::Harmonic), 16},
                                  {2, 2, 4}};
constexpr Size size_of(Field field) {
  if (field >= Field::gain) return kSizes[static_cast<std::size_t>(field) - static_cast<std::size_t>(Field::gain)];
  const std::uint8_t bytes = kIntegers[static_cast<std::size_t>(field)].bytes;
  return {bytes, bytes, bytes < 4 ? std::uint8_t{4} : bytes};
}
constexpr std::size_t aligned(std::size_t at, std::size_t to) {
  return (at + to - 1) & ~(to - 1);
}

struct RowMaker {
  Row& row;
  template <class T>
  constexpr void add() {
    using M = std::remove_cv_t<T>;
    if constexpr (std::is_same_v<M, bool>) {
      row.add(Field::flag);
    } else if constexpr (std::is_same_v<M, effects::Variable>) {
      row.add(Field::variable);
    } else if constexpr (std::is_same_v<M, effects::Balance>) {
      row.add(Field::balance);
    } else if constexpr (std::is_base_of_v<fixed::Value, M> || std::is_base_of_v<fixed::Exponent, M> ||
                         std::is_base_of_v<fixed::Weight, M>) {
      row.add(Field::word);
    } else if constexpr (std::is_base_of_v<fixed::Gain, M>) {
      row.add(Field::gain);
    } else if constexpr (std::is_base_of_v<fixed::StepGain, M>) {
      row.add(Field::step_gain);
    } else if constexpr (std::is_base_of_v<fixed::RatioGain, M>) {
      row.add(Field::ratio_gain);
    } else if constexpr (std::is_base_of_v<fixed::DistanceGain, M>) {
      row.add(Field::distance_gain);
    } else if constexpr (std::is_base_of_v<fixed::Harmonic, M>) {
      row.add(Field::harmonic);
    } else if constexpr (std::is_base_of_v<fixed::Order, M>) {
      row.add(Field::order);
    } else if constexpr (std::is_base_of_v<fixed::Share, M>) {
      row.add(Field::share);
    } else if constexpr (std::is_base_of_v<fixed::State, M> || std::is_base_of_v<fixed::Step, M>) {
      row.add(Field::wide);
    } else if constexpr (!std::is_same_v<M, std::int16_t>) {  // the number of points stands with them
      add_members(M{});
    }
  }
  template <class T, std::size_t Size>
  constexpr void add_array(const std::array<T, Size>&) {
    if constexpr (Size == kMostPoints) {
      row.add(Field::points);
    } else {
      for (std::size_t i = 0; i < Size; ++i) add<T>();
    }
  }
  template <class T>
  constexpr void add_members(const T& object) {
    for_each_member(object, [&]<class M>(const M& member) {
      if constexpr (requires { this->add_array(member); }) {
        add_array(member);
      } else {
        add<M>();
      }
    });
  }
};
}  // namespace detail

// Where the last field ends in memory, aligned as the widest: the size of a struct of this row.
constexpr std::size_t size_in_memory(const Row& row) {
  std::size_t at = 0, widest = 1;
  for (std::size_t i = 0; i < row.size; ++i)
    for (int k = 0; k < often(row.parts[i]); ++k) {
      const auto size = detail::size_of(field_of(row.parts[i]));
      at = detail::aligned(at, size.align) + size.bytes;
      if (size.align > widest) widest = size.align;
      if (field_of(row.parts[i]) == Field::points) {
        at = detail::aligned(at, 4) + 4 * kMostPoints;
        if (widest < 4) widest = 4;
      }
    }
  return detail::aligned(at, widest);
}
// The row of an effect's coefficients, or of another struct of numbers.
template <class T>
constexpr Row row_of() {
  Row row;
  detail::RowMaker{row}.template add<T>();
  return row;
}

// Where a row is wrong.
enum class RowFault : std::uint8_t { none, length, field };
struct RowVerdict {
  RowFault fault = RowFault::none;
  std::int16_t field = -1;  // from nought
};

namespace detail {
inline std::uint32_t word_at(const std::uint8_t* from) {
  std::uint32_t bits;
  std::memcpy(&bits, from, sizeof(bits));
  return bits;
}
inline bool take_integer(const IntegerField& f, const std::uint8_t* from, std::byte* to) {
  const std::uint32_t low = word_at(from);
  const std::uint32_t high = f.bytes == 8         ? word_at(from + 4)
                             : f.low == kMirrored ? static_cast<std::uint32_t>(static_cast<std::int32_t>(low) >> 31)
                                                  : 0;
  const auto x = static_cast<std::int64_t>((std::uint64_t{high} << 32) | low);
  if (x < lowest(f) || x > highest(f)) return false;
  if (to != nullptr) std::memcpy(to, &x, f.bytes);
  return true;
}
// Mantissa 2^(exponent - 30), the mantissa within a factor of two.
constexpr bool normal(std::int32_t mantissa, std::int32_t exponent, std::int32_t least, std::int32_t most) {
  if (mantissa == 0) return exponent == 0;
  const std::int64_t size = mantissa < 0 ? -std::int64_t{mantissa} : mantissa;
  return size >= (std::int64_t{1} << (fixed::kMantissaBits - 1)) && size <= (std::int64_t{1} << fixed::kMantissaBits) &&
         exponent >= least && exponent <= most;
}
// All four begin with mantissa and exponent.
union Floating {
  Floating() { std::memset(static_cast<void*>(this), 0, sizeof(*this)); }
  fixed::Gain gain;
  fixed::StepGain step_gain;
  fixed::RatioGain ratio_gain;
  fixed::DistanceGain distance_gain;
};
static_assert(offsetof(fixed::Gain, exponent) == 4 && offsetof(fixed::StepGain, exponent) == 4 &&
              offsetof(fixed::RatioGain, exponent) == 4 && offsetof(fixed::DistanceGain, exponent) == 4);
inline constexpr std::int8_t kExponents[][2] = {
    {fixed::Gain::kLeastExponent, fixed::Gain::kMostExponent},
    {fixed::StepGain::kLeastExponent, fixed::StepGain::kMostExponent},
    {fixed::RatioGain::kLeastExponent, fixed::RatioGain::kMostExponent},
    {fixed::DistanceGain::kLeastExponent, fixed::DistanceGain::kMostExponent}};
inline bool complete(Field field, Floating& x) {
  switch (field) {
    case Field::gain:
      return fixed::complete(x.gain);
    case Field::step_gain:
      return fixed::complete(x.step_gain);
    case Field::ratio_gain:
      return fixed::complete(x.ratio_gain);
    default:
      return fixed::complete(x.distance_gain);
  }
}
inline bool take_floating(Field field, const std::uint8_t* from, std::byte* to) {
  const auto& exponents = kExponents[static_cast<std::size_t>(field) - static_cast<std::size_t>(Field::gain)];
  const auto mantissa = static_cast<std::int32_t>(word_at(from)),
             exponent = static_cast<std::int32_t>(word_at(from + 4));
  if (!normal(mantissa, exponent, exponents[0], exponents[1])) return false;
  Floating x;
  std::memcpy(static_cast<void*>(&x), from, 5);
  if (!complete(field, x)) return false;
  if (to != nullptr) std::memcpy(to, &x, size_of(field).bytes);
  return true;
}
inline bool take_harmonic(const std::uint8_t* from, std::byte* to) {
  fixed::Harmonic x;
  std::memcpy(&x.order, from, 8);
  x.phase = word_at(from + 8);
  x.amplitude = static_cast<std::int32_t>(word_at(from + 12));
  if (!fixed::complete(x)) return false;
  if (to != nullptr) std::memcpy(to, &x, sizeof(x));
  return true;
}
inline bool take_field(Field field, const std::uint8_t* from, std::byte* to) {
  if (field < Field::gain) return take_integer(kIntegers[static_cast<std::size_t>(field)], from, to);
  return field == Field::harmonic ? take_harmonic(from, to) : take_floating(field, from, to);
}
}  // namespace detail

// Reads a row (of which an end is the last byte) `times` over, each behind the other as in an array, from the bytes of
// an entry into memory, or nowhere: then it is checked alone. All bytes have to be of the row; an array may be shorter
// than it could be. Every field is looked at before any is used: nothing is to be done with memory where it is wrong.
template <bool kTables = true>
RowVerdict take_row(const std::uint8_t* row, std::span<const std::uint8_t> bytes, std::byte* memory, int times = 1) {
  const std::uint8_t* from = bytes.data();
  std::size_t left = bytes.size(), at = 0;
  std::int16_t number = 0;
  for (; times > 0 && (left > 0 || number == 0); --times) {
    std::size_t widest = 1;
    for (const std::uint8_t* part = row; *part != 0; ++part) {
      const Field field = field_of(*part);
      const detail::Size size = detail::size_of(field);
      if (size.align > widest) widest = size.align;
      for (int k = often(*part); k > 0; --k, ++number) {
        if (left < size.in_block) return {RowFault::length, -1};
        at = detail::aligned(at, size.align);
        std::byte* const to = memory == nullptr ? nullptr : memory + at;
        if (kTables && field == Field::points) {
          const std::size_t words = detail::word_at(from);
          if (words < 2 || words > kMostPoints) return {RowFault::field, number};
          if (left < size.in_block + 4 * words) return {RowFault::length, -1};
          if (to != nullptr) std::memcpy(to, &words, size.bytes);
          for (std::size_t i = 0; i < words; ++i) {
            from += 4;
            left -= 4;
            const std::size_t offset = detail::aligned(size.bytes, 4) + 4 * i;
            if (!detail::take_field(Field::word, from, to == nullptr ? nullptr : to + offset))
              return {RowFault::field, static_cast<std::int16_t>(number + 1)};
          }
        } else if (!detail::take_field(field, from, to)) {
          return {RowFault::field, number};
        }
        at += size.bytes;
        from += size.in_block;
        left -= size.in_block;
      }
    }
    at = detail::aligned(at, widest);
  }
  return left == 0 ? RowVerdict{} : RowVerdict{RowFault::length, -1};
}

// Host only: writes what take_row reads.
inline void put_row(Writer& w, const std::uint8_t* row, const std::byte* memory, int times = 1) {
  std::size_t at = 0;
  const auto bytes = [&](std::size_t from, std::size_t count, bool is_signed, std::size_t in_block) {
    std::int64_t x = 0;
    std::memcpy(&x, memory + from, count);
    if (is_signed && count < 8)
      x = static_cast<std::int64_t>(static_cast<std::uint64_t>(x) << (64 - 8 * count)) >> (64 - 8 * count);
    if (in_block == 4) {
      w.put(static_cast<std::int32_t>(x));
    } else {
      w.put(x);
    }
    return x;
  };
  for (; times > 0; --times) {
    std::size_t widest = 1;
    for (const std::uint8_t* part = row; *part != 0; ++part) {
      const Field field = field_of(*part);
      const detail::Size size = detail::size_of(field);
      if (size.align > widest) widest = size.align;
      for (int k = often(*part); k > 0; --k) {
        at = detail::aligned(at, size.align);
        if (field == Field::points) {
          const std::int64_t words = bytes(at, 2, true, 4);
          const std::size_t start = detail::aligned(at + size.bytes, 4);
          for (std::int64_t i = 0; i < words; ++i) bytes(start + 4 * static_cast<std::size_t>(i), 4, true, 4);
          at = start + 4 * (kMostPoints - 1) + 2;
        } else if (field == Field::harmonic) {
          bytes(at, 8, true, 8);
          bytes(at + 8, 4, true, 4);
          bytes(at + 12, 4, true, 4);
        } else if (field >= Field::gain) {
          bytes(at, 4, true, 4);      // mantissa
          bytes(at + 4, 1, true, 4);  // exponent
        } else {
          const IntegerField& f = kIntegers[static_cast<std::size_t>(field)];
          bytes(at, f.bytes, f.low == kMirrored, size.in_block);
        }
        at += size.bytes;
      }
    }
    at = detail::aligned(at, widest);
  }
}

}  // namespace flexspline::model
