// The parameter block: all that a drive knows of its model, as bytes. README.md has the format. One validator serves
// the host, the drive when a block arrives, and the drive when it starts: integers only, no heap, no recursion.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

#include "shared/model/drive_model.hpp"
#include "shared/model/encoding.hpp"
#include "shared/model/rows.hpp"

namespace flexspline::model {

inline constexpr std::uint32_t kBlockMagic = 0x4B4C4246;  // "FBLK"
inline constexpr std::uint16_t kBlockVersion = 1;
inline constexpr std::size_t kLargestBlock = 16384;
inline constexpr std::size_t kMostEntries = 64;

// What an entry holds. Below 256: coefficients of the effect of that number. From kFirstNote on: notes that the drive
// keeps and does not read.
// Sections: what the drive's tick needs beside the model (shared/control/drive_block.hpp). A section that changes gets
// another number; numbers are never given again.
enum class Section : std::uint16_t {
  encoder_filter = 0x100,  // of the motor
  feedforward = 0x101,
  loops = 0x102,
  trajectory = 0x103,
  torque_ripple_filter = 0x105,
  general = 0x110,
  motor_encoder = 0x111,
  output_encoder = 0x112,
  output_filter = 0x113,
  disturbance = 0x114,
  torsion = 0x115,
  sensors = 0x116,
  excitation = 0x117,
  excitation_lines = 0x118,
  safety = 0x119,
  residual_map = 0x11A,
  following = 0x11B,
};
inline constexpr std::uint16_t kFirstNote = 0xF000;
inline constexpr std::uint16_t kParametersNote = 0xF000;  // what the effects were derived from, for `unpack`

using Name = std::array<char, 32>;  // UTF-8, the rest noughts

// The bases of per-unit numbers and known facts, in the order of effects::DriveConstants; SI. The drive does not
// compute with them, but says them to who reads its signals.
struct Bases {
  Number gear_ratio, torque_constant, rated_velocity, reference_temperature, turn_angle_scale;
  Number torque, output_torque, velocity, output_velocity, acceleration, output_acceleration;
  Number angle, torsion, torsion_rate;
  std::array<Number, 3> others;  // temperature, current, time (one tick)
  Number temperature() const { return others[0]; }
  Number current() const { return others[1]; }
  Number tick() const { return others[2]; }
};
// Per unit of their bases; each above nought and within two.
struct Limits {
  fixed::Value torque;     // of the motor
  fixed::Value load;       // of the output
  fixed::Value velocity;   // of the motor: full torque up to here
  fixed::Value overspeed;  // no torque that drives from here on
  fixed::Value current;
  fixed::Value torsion;
  fixed::Value direction_band;  // velocity above which friction acts in full
};
struct BlockHeader {
  Name drive{};  // which drive it is meant for
  Name model{};
  std::uint32_t axis = 0;            // 0 rotary, 1 linear
  std::uint32_t encoder_counts = 0;  // per motor turn; nought: not known
  Bases bases{};
  Limits limits{};
};

enum class BlockFault : std::uint8_t {
  none,
  too_short,
  too_long,
  wrong_magic,
  unknown_version,
  wrong_length,
  wrong_checksum,
  wrong_name,
  wrong_base,
  wrong_limit,
  wrong_header,
  too_many_entries,
  entry_cut_off,
  entry_of_wrong_length,
  unknown_entry,
  missing_effect,
  too_often,
  wrong_coefficient,
  unlike_coefficients,
  missing_section,
  other_tick_rate,
  armed,              // good, but the drive is armed
  unreachable_limit,  // of a protection: its signal cannot show that it was passed
  other_hardware,     // full scales, currents or sensors are not those of this board
};
// Where a block is wrong: which entry (from nought; of the header: -1), and which field in it where one is to blame.
struct BlockVerdict {
  BlockFault fault = BlockFault::none;
  std::int16_t entry = -1;
  std::int16_t field = -1;
  std::uint16_t kind = 0;  // of that entry: number of the effect, or section
  constexpr bool good() const { return fault == BlockFault::none; }
};

namespace detail {
inline constexpr std::size_t kEntryHeader = 8;  // u16 kind, u16 nought, u32 bytes that follow
inline constexpr std::size_t kBlockStart = 12;  // u32 magic, u16 version, u16 entries, u32 bytes in all
inline constexpr std::size_t kHeaderBytes = 2 * 32 + 2 * 4 + 17 * 8 + 7 * 4;
inline constexpr std::size_t kChecksum = 4;
inline constexpr std::size_t kLeastBlock = kBlockStart + kHeaderBytes + kChecksum;

// Printable from the first to the last character, noughts behind, the last of all a nought.
inline bool is_name(const std::uint8_t* name) {
  bool ended = false;
  for (std::size_t i = 0; i < sizeof(Name); ++i) {
    const std::uint8_t byte = name[i];
    if (byte != 0 && (ended || byte < 0x20 || byte == 0x7F)) return false;
    ended = ended || byte == 0;
  }
  return ended;
}
inline constexpr int kBases = 17;
inline constexpr int kReferenceTemperature = 3;
inline constexpr int kLimits = 7;
inline constexpr int kVelocityLimit = 2;  // and behind it the overspeed
// Fields count from the drive's name on. All bytes of the header are there.
inline BlockVerdict check_header(const std::uint8_t* at) {
  std::int16_t field = 0;
  const auto wrong = [&](BlockFault fault) { return BlockVerdict{fault, -1, field, 0}; };
  const auto next = [&] {
    const std::uint32_t word = word_at(at);
    at += 4;
    return word;
  };
  for (; field < 2; ++field, at += sizeof(Name))
    if (!is_name(at)) return wrong(BlockFault::wrong_name);
  if (next() > 1) return wrong(BlockFault::wrong_header);
  ++field;
  if (next() > (std::uint32_t{1} << 30)) return wrong(BlockFault::wrong_header);
  ++field;
  for (int i = 0; i < kBases; ++i, ++field) {
    const auto mantissa = static_cast<std::int32_t>(next()), exponent = static_cast<std::int32_t>(next());
    if (!normal(mantissa, exponent, -100, 100) || (mantissa <= 0 && i != kReferenceTemperature))
      return wrong(BlockFault::wrong_base);
  }
  std::uint32_t velocity = 0;
  for (int i = 0; i < kLimits; ++i, ++field) {
    constexpr std::uint32_t kTwo = std::uint32_t{2} << fixed::kValueBits;
    const std::uint32_t limit = next();
    if (limit - 1 >= kTwo) return wrong(BlockFault::wrong_limit);
    if (i == kVelocityLimit) velocity = limit;
    if (i == kVelocityLimit + 1 && velocity >= limit) return wrong(BlockFault::wrong_limit);
  }
  return {};
}
// Puts an entry around what `fill(writer)` writes.
template <class Fill>
constexpr void put_entry(Writer& w, std::uint16_t kind, Fill&& fill) {
  Writer count({});
  fill(count);
  w.put(kind);
  w.put(std::uint16_t{0});
  w.put(static_cast<std::uint32_t>(count.size()));
  fill(w);
}
}  // namespace detail

// What the block at the start of these bytes states as its length; nought where none begins there.
constexpr std::size_t stated_bytes(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < detail::kLeastBlock) return 0;
  Reader r(bytes);
  if (r.take<std::uint32_t>() != kBlockMagic) return 0;
  r.take<std::uint32_t>();
  return r.take<std::uint32_t>();
}

// Walks the entries of a block that was found good. visit(kind, bytes of it).
template <class Visit>
void for_each_entry(std::span<const std::uint8_t> block, Visit&& visit) {
  std::size_t at = detail::kBlockStart + detail::kHeaderBytes;
  for (std::uint32_t left = detail::word_at(block.data() + 4) >> 16; left > 0; --left) {
    const std::uint32_t kind = detail::word_at(&block[at]), bytes = detail::word_at(&block[at + 4]);
    visit(static_cast<std::uint16_t>(kind), block.subspan(at + detail::kEntryHeader, bytes));
    at += detail::kEntryHeader + bytes;
  }
}

// Start, length, checksum and header; not the entries.
inline BlockVerdict check_start(std::span<const std::uint8_t> block) {
  if (block.size() < detail::kLeastBlock) return {BlockFault::too_short};
  if (block.size() > kLargestBlock) return {BlockFault::too_long};
  const std::uint8_t* const at = block.data();
  if (detail::word_at(at) != kBlockMagic) return {BlockFault::wrong_magic};
  const std::uint32_t version_and_entries = detail::word_at(at + 4);
  if ((version_and_entries & 0xFFFF) != kBlockVersion) return {BlockFault::unknown_version};
  if (detail::word_at(at + 8) != block.size()) return {BlockFault::wrong_length};
  const std::size_t before_checksum = block.size() - detail::kChecksum;
  if (detail::word_at(at + before_checksum) != crc32(block.first(before_checksum))) return {BlockFault::wrong_checksum};
  if (const BlockVerdict v = detail::check_header(at + detail::kBlockStart); !v.good()) return v;
  if ((version_and_entries >> 16) > kMostEntries) return {BlockFault::too_many_entries};
  return {};
}

// A base of a block that was found good, by its place in Bases.
inline Number base_at(std::span<const std::uint8_t> block, std::size_t place) {
  const std::uint8_t* const at = block.data() + detail::kBlockStart + 2 * sizeof(Name) + 8 + 8 * place;
  return {static_cast<std::int32_t>(detail::word_at(at)), static_cast<std::int32_t>(detail::word_at(at + 4))};
}
inline constexpr std::size_t kOutputTorqueBase = 6, kTemperatureBase = 14, kCurrentBase = 15;

// The header of a block that was found good.
inline BlockHeader header_of(std::span<const std::uint8_t> block) {
  BlockHeader h;
  Reader r(block.subspan(detail::kBlockStart));
  for (Name* name : {&h.drive, &h.model})
    for (char& c : *name) c = static_cast<char>(r.take<std::uint8_t>());
  h.axis = r.take<std::uint32_t>();
  h.encoder_counts = r.take<std::uint32_t>();
  const auto take = [&](Number& n) {
    n.mantissa = r.take<std::int32_t>();
    n.exponent = r.take<std::int32_t>();
  };
  for_each_member(h.bases, [&]<class M>(M& member) {
    if constexpr (std::is_same_v<M, Number>) {
      take(member);
    } else {
      for (Number& one : member) take(one);
    }
  });
  for_each_member(h.limits, [&](fixed::Value& limit) { limit.raw = r.take<std::int32_t>(); });
  return h;
}

// What an image can take of a block: effects into a model, sections into settings.
struct EffectPlace {
  std::uint16_t at;  // of Places<Effect, N, Count> in all places: a count and then the coefficients, from `start` on
  std::uint16_t stride;
  std::uint8_t number;
  std::uint8_t count;
  std::uint8_t start;
  std::uint8_t row;  // where it begins among all rows
};
struct SectionPlace {
  bool (*agrees)(const void* section, void* context);  // what its fields cannot say each by itself; null: nothing
  std::uint16_t kind;
  std::uint16_t at;  // in the settings
  std::uint8_t row;
  std::uint8_t times;  // an array of so many
};
struct BlockPlaces {
  std::span<const EffectPlace> effects;
  const std::uint8_t* effect_rows;
  std::span<const SectionPlace> sections;
  const std::uint8_t* section_rows;
};
// Sections whose fields have to agree are no larger than this.
inline constexpr std::size_t kLargestChecked = 160;

namespace detail {
constexpr BlockVerdict verdict_of(const RowVerdict& v) {
  switch (v.fault) {
    case RowFault::none:
      return {};
    case RowFault::length:
      return {BlockFault::entry_of_wrong_length};
    case RowFault::field:
      break;
  }
  return {BlockFault::wrong_coefficient, -1, v.field, 0};
}
// What an entry is read into and what is kept while a block is read.
struct Reading {
  const BlockPlaces& places;
  void* model;
  void* settings;
  void* context;
  std::uint32_t seen = 0;
  std::uint8_t often[effects::kLastId + 1]{};
};
template <bool kTables>
BlockVerdict take_effect(Reading& r, std::uint32_t kind, std::span<const std::uint8_t> bytes) {
  for (const EffectPlace& place : r.places.effects) {
    if (place.number != kind) continue;
    const std::size_t before = r.often[kind]++;
    if (before == place.count) return {BlockFault::too_often};
    std::byte* memory = nullptr;
    if (r.model != nullptr) {
      std::byte* const all = static_cast<std::byte*>(r.model) + place.at;
      *all = static_cast<std::byte>(before + 1);
      memory = all + place.start + place.stride * before;
    }
    return verdict_of(take_row<kTables>(r.places.effect_rows + place.row, bytes, memory));
  }
  return {BlockFault::missing_effect};
}
template <bool kTables>
BlockVerdict take_section(Reading& r, std::uint32_t kind, std::span<const std::uint8_t> bytes) {
  std::uint32_t bit = 1;
  for (const SectionPlace& place : r.places.sections) {
    if (place.kind != kind) {
      bit <<= 1;
      continue;
    }
    if ((r.seen & bit) != 0) return {BlockFault::too_often};
    r.seen |= bit;
    alignas(8) std::byte checked[kLargestChecked];
    std::byte* memory = r.settings != nullptr     ? static_cast<std::byte*>(r.settings) + place.at
                        : place.agrees != nullptr ? checked
                                                  : nullptr;
    const RowVerdict v = take_row<kTables>(r.places.section_rows + place.row, bytes, memory, place.times);
    if (v.fault == RowFault::none && place.agrees != nullptr && !place.agrees(memory, r.context))
      return {BlockFault::unlike_coefficients};
    return verdict_of(v);
  }
  return {BlockFault::unknown_entry};
}
}  // namespace detail

// The one validator. Looks at all of a block: start, checksum, header, each entry, each field. Notes are passed over.
// With a model (DriveModel of the image that `places` is of, at rest) and settings, either may be null, it fills them
// as well; where the verdict is not good, what was read is not to be used. `seen` says which sections there were, by
// their place; `context` is handed to those that agree with something.
template <bool kTables>
BlockVerdict read_block(std::span<const std::uint8_t> block, const BlockPlaces& places, void* model, void* settings,
                        std::uint32_t& seen, void* context) {
  if (const BlockVerdict v = check_start(block); !v.good()) return v;
  detail::Reading reading{places, model, settings, context};
  if (model != nullptr)
    for (const EffectPlace& place : places.effects) static_cast<std::byte*>(model)[place.at] = std::byte{0};
  const std::uint8_t* at = block.data() + detail::kBlockStart + detail::kHeaderBytes;
  const std::uint8_t* const end = block.data() + block.size() - detail::kChecksum;
  const auto entries = static_cast<std::int16_t>(detail::word_at(block.data() + 4) >> 16);
  for (std::int16_t entry = 0; entry < entries; ++entry) {
    if (end - at < static_cast<std::ptrdiff_t>(detail::kEntryHeader)) return {BlockFault::entry_cut_off, entry};
    const std::uint32_t kind = detail::word_at(at), length = detail::word_at(at + 4);
    at += detail::kEntryHeader;
    BlockVerdict v;
    if (kind > 0xFFFF) {  // what has to be nought
      v = {BlockFault::unknown_entry};
    } else if (length > static_cast<std::size_t>(end - at)) {
      v = {BlockFault::entry_cut_off};
    } else if (kind <= effects::kLastId) {
      v = detail::take_effect<kTables>(reading, kind, {at, length});
    } else if (kind < 0x100) {
      v = {BlockFault::missing_effect};
    } else if (kind < kFirstNote) {
      v = detail::take_section<kTables>(reading, kind, {at, length});
    }
    if (!v.good()) {
      v.entry = entry;
      v.kind = static_cast<std::uint16_t>(kind);
      return v;
    }
    at += length;
  }
  if (at != end) return {BlockFault::wrong_length};
  seen = reading.seen;
  return {};
}

// Reads coefficients of a struct alone, as it stands in an entry.
template <class T>
RowVerdict read_row(std::span<const std::uint8_t> bytes, T& coefficients) {
  static constexpr Row kRow = row_of<T>();
  static_assert(size_in_memory(kRow) == sizeof(T));
  return take_row(kRow.parts.data(), bytes, reinterpret_cast<std::byte*>(&coefficients));
}

// Writes a block; host only in use, but of integers all the same. Entries are added between begin() and end().
class BlockWriter {
 public:
  explicit constexpr BlockWriter(std::span<std::uint8_t> room) : room_(room), writer_(room) {}
  constexpr void begin(const BlockHeader& h) {
    writer_.put(kBlockMagic);
    writer_.put(kBlockVersion);
    writer_.put(std::uint16_t{0});
    writer_.put(std::uint32_t{0});
    for (const Name* name : {&h.drive, &h.model})
      for (const char c : *name) writer_.put(static_cast<std::uint8_t>(c));
    writer_.put(h.axis);
    writer_.put(h.encoder_counts);
    for_each_member(h.bases, [&]<class M>(const M& member) {
      if constexpr (std::is_same_v<M, Number>) {
        put(writer_, member);
      } else {
        for (const Number& one : member) put(writer_, one);
      }
    });
    for_each_member(h.limits, [&](const fixed::Value& limit) { writer_.put(limit.raw); });
  }
  // Coefficients of an effect, or another struct of numbers.
  template <class T>
  void add(std::uint16_t kind, const T& coefficients) {
    static constexpr Row kRow = row_of<T>();
    static_assert(size_in_memory(kRow) == sizeof(T));
    add_row(kind, kRow.parts.data(), &coefficients);
  }
  void add_row(std::uint16_t kind, const std::uint8_t* row, const void* memory, int times = 1) {
    detail::put_entry(writer_, kind, [&](Writer& w) { put_row(w, row, static_cast<const std::byte*>(memory), times); });
    ++entries_;
  }
  constexpr void add_bytes(std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    detail::put_entry(writer_, kind, [&](Writer& w) {
      for (const std::uint8_t byte : bytes) w.put(byte);
    });
    ++entries_;
  }
  // The length in all, or nought where there was not enough room.
  constexpr std::size_t end() {
    const std::size_t size = writer_.size() + detail::kChecksum;
    if (size > room_.size()) return 0;
    Writer start(room_.subspan(6));
    start.put(entries_);
    start.put(static_cast<std::uint32_t>(size));
    writer_.put(crc32(room_.first(size - detail::kChecksum)));
    return size;
  }

 private:
  std::span<std::uint8_t> room_;
  Writer writer_;
  std::uint16_t entries_ = 0;
};

}  // namespace flexspline::model
