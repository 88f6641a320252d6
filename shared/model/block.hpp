// The parameter block: all that a drive knows of its model, as bytes. README.md has the format. One validator serves
// the host, the drive when a block arrives, and the drive when it starts: integers only, no heap, no recursion.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/model/drive_model.hpp"
#include "shared/model/encoding.hpp"

namespace flexspline::model {

inline constexpr std::uint32_t kBlockMagic = 0x4B4C4246;  // "FBLK"
inline constexpr std::uint16_t kBlockVersion = 1;
inline constexpr std::size_t kLargestBlock = 16384;
inline constexpr std::size_t kMostEntries = 64;

// What an entry holds. Below 256: coefficients of the effect of that number. From kFirstNote on: notes that the drive
// keeps and does not read.
enum class Section : std::uint16_t {
  encoder_filter = 0x100,
  feedforward = 0x101,
  loops = 0x102,
  trajectory = 0x103,
  rate_limiter = 0x104,
  torque_ripple_filter = 0x105,
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
};
constexpr const char* text_of(BlockFault fault) {
  switch (fault) {
    case BlockFault::none:
      return "no fault";
    case BlockFault::too_short:
      return "it ends before its header does";
    case BlockFault::too_long:
      return "it is longer than any block may be";
    case BlockFault::wrong_magic:
      return "it does not begin as a parameter block does";
    case BlockFault::unknown_version:
      return "its version is not known here";
    case BlockFault::wrong_length:
      return "its length is not the one that it states";
    case BlockFault::wrong_checksum:
      return "its checksum does not fit its bytes";
    case BlockFault::wrong_name:
      return "a name holds what is no text";
    case BlockFault::wrong_base:
      return "a base is not a positive number";
    case BlockFault::wrong_limit:
      return "a limit is not between nought and two bases";
    case BlockFault::wrong_header:
      return "a field of the header holds what it may not";
    case BlockFault::too_many_entries:
      return "it has more entries than a drive takes";
    case BlockFault::entry_cut_off:
      return "an entry goes beyond the end";
    case BlockFault::entry_of_wrong_length:
      return "an entry is longer or shorter than its coefficients";
    case BlockFault::unknown_entry:
      return "an entry is of no known kind";
    case BlockFault::missing_effect:
      return "an effect is not in this firmware";
    case BlockFault::too_often:
      return "an effect or a section stands more often than the drive has places";
    case BlockFault::wrong_coefficient:
      return "a coefficient is outside the bounds of its format";
  }
  return "unknown fault";
}

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
constexpr bool is_name(const Name& name) {
  bool ended = false;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte != 0 && (ended || byte < 0x20 || byte == 0x7F)) return false;
    ended = ended || byte == 0;
  }
  return ended;
}
constexpr BlockVerdict take_header(Reader& r, BlockHeader& h) {
  BlockVerdict v;
  const auto wrong = [&](BlockFault fault, int field) {
    if (v.good()) v = {fault, -1, static_cast<std::int16_t>(field), 0};
  };
  for (Name* name : {&h.drive, &h.model}) {
    for (char& c : *name) c = static_cast<char>(r.take<std::uint8_t>());
    if (!is_name(*name)) wrong(BlockFault::wrong_name, name == &h.model ? 1 : 0);
  }
  h.axis = r.take<std::uint32_t>();
  if (h.axis > 1) wrong(BlockFault::wrong_header, 2);
  h.encoder_counts = r.take<std::uint32_t>();
  if (h.encoder_counts > (std::uint32_t{1} << 30)) wrong(BlockFault::wrong_header, 3);
  int field = 4;
  const auto base = [&](Number& n, bool any_sign) {
    if (!Encoding<Number>::take(r, n) || (!any_sign && n.mantissa <= 0)) wrong(BlockFault::wrong_base, field);
    ++field;
  };
  for_each_member(h.bases, [&]<class M>(M& member) {
    if constexpr (std::is_same_v<M, Number>) {
      base(member, &member == &h.bases.reference_temperature);
    } else {
      for (Number& one : member) base(one, false);
    }
  });
  for_each_member(h.limits, [&](fixed::Value& limit) {
    constexpr std::int32_t kTwo = std::int32_t{2} << fixed::kValueBits;
    if (!Encoding<fixed::Value>::take(r, limit) || limit.raw <= 0 || limit.raw > kTwo)
      wrong(BlockFault::wrong_limit, field);
    ++field;
  });
  if (v.good() && h.limits.velocity.raw >= h.limits.overspeed.raw) wrong(BlockFault::wrong_limit, field - 4);
  return v;
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

// Walks the entries of a block that was found good as a whole. visit(kind, bytes of it).
template <class Visit>
constexpr void for_each_entry(std::span<const std::uint8_t> block, Visit&& visit) {
  Reader start(block.subspan(6));
  const auto entries = start.take<std::uint16_t>();
  std::size_t at = detail::kBlockStart + detail::kHeaderBytes;
  for (std::uint16_t i = 0; i < entries; ++i) {
    Reader r(block.subspan(at));
    const auto kind = r.take<std::uint16_t>();
    r.take<std::uint16_t>();
    const auto bytes = r.take<std::uint32_t>();
    visit(kind, block.subspan(at + detail::kEntryHeader, bytes));
    at += detail::kEntryHeader + bytes;
  }
}

// Start, length, checksum, header and frame of the entries; not what is in them.
constexpr BlockVerdict check_frame(std::span<const std::uint8_t> block, BlockHeader& header) {
  if (block.size() < detail::kLeastBlock) return {BlockFault::too_short};
  if (block.size() > kLargestBlock) return {BlockFault::too_long};
  Reader r(block.first(block.size() - detail::kChecksum));
  if (r.take<std::uint32_t>() != kBlockMagic) return {BlockFault::wrong_magic};
  if (r.take<std::uint16_t>() != kBlockVersion) return {BlockFault::unknown_version};
  const auto entries = r.take<std::uint16_t>();
  if (r.take<std::uint32_t>() != block.size()) return {BlockFault::wrong_length};
  Reader end(block.last(detail::kChecksum));
  if (end.take<std::uint32_t>() != crc32(block.first(block.size() - detail::kChecksum)))
    return {BlockFault::wrong_checksum};
  if (const BlockVerdict v = detail::take_header(r, header); !v.good()) return v;
  if (entries > kMostEntries) return {BlockFault::too_many_entries};
  for (std::uint16_t i = 0; i < entries; ++i) {
    const auto at = static_cast<std::int16_t>(i);
    if (r.left() < detail::kEntryHeader) return {BlockFault::entry_cut_off, at};
    const auto kind = r.take<std::uint16_t>();
    if (r.take<std::uint16_t>() != 0) return {BlockFault::unknown_entry, at, -1, kind};
    const auto bytes = r.take<std::uint32_t>();
    if (bytes > r.left()) return {BlockFault::entry_cut_off, at, -1, kind};
    for (std::uint32_t b = 0; b < bytes; ++b) r.take<std::uint8_t>();
  }
  if (r.left() != 0) return {BlockFault::wrong_length};
  return {};
}

// What the sections of a block are read into; firmware has a T with a section each, by Section's numbers.
// `sections.section(number, bytes)` returns BlockFault::unknown_entry for those that it does not have.
struct NoSections {
  constexpr BlockVerdict section(std::uint16_t, std::span<const std::uint8_t>) { return {BlockFault::unknown_entry}; }
};
// Reads a section's coefficients (EncoderKalman::Coefficients<Fixed>, ...).
template <class T>
constexpr BlockVerdict read_section(std::span<const std::uint8_t> bytes, T& coefficients) {
  Reader r(bytes);
  std::int16_t wrong = -1;
  if constexpr (HasFields<T>) {
    if (!Encoding<T>::take(r, coefficients)) wrong = 0;
  } else {
    std::int16_t at = 0;
    for_each_member(coefficients, [&]<class M>(M& member) {
      if (!Encoding<M>::take(r, member) && wrong < 0) wrong = at;
      ++at;
    });
  }
  if (!r.whole()) return {BlockFault::entry_of_wrong_length};
  if (wrong >= 0) return {BlockFault::wrong_coefficient, -1, wrong, 0};
  if (r.left() != 0) return {BlockFault::entry_of_wrong_length};
  return {};
}

namespace detail {
// Reads one effect into the model. Which one: looked for by its number.
template <class Model>
constexpr BlockVerdict add_entry(Model& into, std::uint16_t kind, std::span<const std::uint8_t> bytes) {
  BlockVerdict v{BlockFault::missing_effect};
  into.for_each([&]<class Effect>(auto&) {
    if (Model::template number_of<Effect>() != kind) return;
    using Coefficients = typename Effect::template Coefficients<typename Model::Numbers>;
    Coefficients c{};
    v = read_section(bytes, c);
    if (v.good() && !into.template add<Effect>(c)) v = {BlockFault::too_often};
  });
  return v;
}
}  // namespace detail

// Reads a block into a model at rest (emptied first) and `sections`. Checks all of it; where the verdict is not good,
// what was read is not to be used. Notes are passed over.
template <class Model, class Sections>
constexpr BlockVerdict load(std::span<const std::uint8_t> block, BlockHeader& header, Model& into, Sections& sections) {
  into.clear();
  if (const BlockVerdict v = check_frame(block, header); !v.good()) return v;
  BlockVerdict found;
  std::int16_t at = 0;
  for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (found.good() && kind < kFirstNote) {
      found = kind < 0x100 ? detail::add_entry(into, kind, bytes) : sections.section(kind, bytes);
      if (!found.good()) {
        found.entry = at;
        found.kind = kind;
      }
    }
    ++at;
  });
  return found;
}
template <class Model>
constexpr BlockVerdict load(std::span<const std::uint8_t> block, BlockHeader& header, Model& into) {
  NoSections none;
  return load(block, header, into, none);
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
    Encoding<Bases>::put(writer_, h.bases);
    Encoding<Limits>::put(writer_, h.limits);
  }
  // Coefficients of an effect or of a section.
  template <class T>
  constexpr void add(std::uint16_t kind, const T& coefficients) {
    detail::put_entry(writer_, kind, [&](Writer& w) { Encoding<T>::put(w, coefficients); });
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
