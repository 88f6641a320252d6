// The parameter block: the drive's model and settings as bytes. README.md has the format. One validator serves
// the host, the drive when a block arrives, and the drive when it starts: integers only, no heap, no recursion.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

#include "shared/model/drive_model.hpp"
#include "shared/model/encoding.hpp"
#include "shared/model/fields.hpp"

namespace flexspline::model {

inline constexpr std::uint32_t kBlockMagic = 0x4B4C4246;  // "FBLK"
inline constexpr std::uint16_t kBlockVersion = 1;
inline constexpr std::size_t kLargestBlock = 16384;
inline constexpr std::size_t kMostEntries = 64;

// The kinds of entries. Below 256: coefficients of the effect of that number. From kFirstNote on: notes, which the
// drive stores and does not read. Sections: what the drive's tick needs in addition to the model
// (shared/control/drive_block.hpp). A section that changes gets another number; numbers are not reused.
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
  stored_zero = 0x11C,
  rates = 0x11D,
  // Of a three-phase stage. 0x11E was the same with other units of the current loop, and is refused.
  motor = 0x11F,
};
inline constexpr std::uint16_t kFirstNote = 0xF000;
inline constexpr std::uint16_t kParametersNote = 0xF000;  // the SI parameters of the effects, for `unpack`

using Name = std::array<char, 32>;  // UTF-8, the rest zeros

// The bases of per-unit numbers and drive constants, in the order of effects::DriveConstants; SI. The drive does not
// compute with them, but reports them to readers of its signals.
struct Bases {
  Number gear_ratio, torque_constant, rated_velocity, reference_temperature, turn_angle_scale;
  Number torque, output_torque, velocity, output_velocity, acceleration, output_acceleration;
  Number angle, torsion, torsion_rate;
  std::array<Number, 3> others;  // temperature, current, time (one tick)
  Number temperature() const { return others[0]; }
  Number current() const { return others[1]; }
  Number tick() const { return others[2]; }
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(gear_ratio), c(torque_constant), c(rated_velocity), c(reference_temperature), c(turn_angle_scale);
    c(torque), c(output_torque), c(velocity), c(output_velocity), c(acceleration), c(output_acceleration);
    c(angle), c(torsion), c(torsion_rate), c(others[0]), c(others[1]), c(others[2]);
  }
};
// Per unit of their bases; each above zero and within two.
struct Limits {
  fixed::Value torque;     // of the motor
  fixed::Value load;       // of the output
  fixed::Value velocity;   // of the motor: full torque up to here
  fixed::Value overspeed;  // no driving torque from here on
  fixed::Value current;
  fixed::Value torsion;
  fixed::Value direction_band;  // velocity above which friction acts in full
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(torque), c(load), c(velocity), c(overspeed), c(current), c(torsion), c(direction_band);
  }
};
struct BlockHeader {
  Name drive{};  // which drive it is meant for
  Name model{};
  std::uint32_t axis = 0;            // 0 rotary, 1 linear
  std::uint32_t encoder_counts = 0;  // per motor turn; zero: not known
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
  armed,              // valid, but the drive is armed
  unreachable_limit,  // of a protection: its signal cannot show that it is exceeded, or its time is too long
  other_hardware,     // full scales, currents or sensors are not those of this board
};
// Where a block is invalid: the entry (from zero; the header is -1), and the field in it if one is the cause.
struct BlockVerdict {
  BlockFault fault = BlockFault::none;
  std::int16_t entry = -1;
  std::int16_t field = -1;
  std::uint16_t kind = 0;  // of that entry: number of the effect, or section
  constexpr bool good() const { return fault == BlockFault::none; }
};

namespace detail {
inline constexpr std::size_t kEntryHeader = 8;  // u16 kind, u16 zero, u32 bytes that follow
inline constexpr std::size_t kBlockStart = 12;  // u32 magic, u16 version, u16 entries, u32 bytes in all
inline constexpr std::size_t kHeaderBytes = 2 * 32 + 2 * 4 + 17 * 8 + 7 * 4;
inline constexpr std::size_t kChecksum = 4;
inline constexpr std::size_t kLeastBlock = kBlockStart + kHeaderBytes + kChecksum;

// Printable from the first to the last character, then zeros, at least one.
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
inline constexpr int kVelocityLimit = 2;  // and after it the overspeed
// Fields count from the drive's name on. The header is complete.
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

// The length that the block at the start of these bytes states; zero where none begins there.
constexpr std::size_t stated_bytes(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < detail::kLeastBlock) return 0;
  Reader r(bytes);
  if (r.take<std::uint32_t>() != kBlockMagic) return 0;
  r.take<std::uint32_t>();
  return r.take<std::uint32_t>();
}

// Calls visit(kind, bytes) for each entry of a block that was found valid.
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

// A base of a block that was found valid, by its place in Bases.
inline Number base_at(std::span<const std::uint8_t> block, std::size_t place) {
  const std::uint8_t* const at = block.data() + detail::kBlockStart + 2 * sizeof(Name) + 8 + 8 * place;
  return {static_cast<std::int32_t>(detail::word_at(at)), static_cast<std::int32_t>(detail::word_at(at + 4))};
}
inline constexpr std::size_t kOutputTorqueBase = 6, kTemperatureBase = 14, kCurrentBase = 15;

// The header of a block that was found valid.
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
  const auto limit = [&](fixed::Value& x) { x.raw = r.take<std::int32_t>(); };
  h.bases.fields(take);
  h.limits.fields(limit);
  return h;
}

namespace detail {
constexpr BlockVerdict verdict_of(const FieldVerdict& v) {
  switch (v.fault) {
    case FieldFault::none:
      return {};
    case FieldFault::length:
      return {BlockFault::entry_of_wrong_length};
    case FieldFault::field:
      break;
  }
  return {BlockFault::wrong_coefficient, -1, v.field, 0};
}

// Reads entries of effects into the model of an image, or checks them alone where there is no model.
template <class Model>
class EffectReader {
 public:
  explicit EffectReader(Model* model) : model_(model) {}
  BlockVerdict take(std::uint32_t id, std::span<const std::uint8_t> bytes) {
    const Image& image = kImage[id];
    if (image.most == 0) return {BlockFault::missing_effect};
    if (count_[id] == image.most) return {BlockFault::too_often};
    FieldReader reader(bytes);
    image.take(reader, model_, count_[id]++);
    return verdict_of(reader.verdict());
  }

 private:
  using Take = void (*)(FieldReader&, Model*, std::uint8_t index);
  struct Image {
    Take take;
    std::uint8_t most;  // of this effect in a model
  };
  template <std::size_t Id>
  static void take_one(FieldReader& reader, Model* model, std::uint8_t index) {
    if (model == nullptr) {
      typename Model::template PlaceOf<Id>::Effect::template Coefficients<typename Model::Numbers> checked{};
      take_fields(reader, checked);
    } else {
      auto& places = model->template place<Id>();
      places.count = static_cast<std::uint8_t>(index + 1);
      take_fields(reader, places.coefficients[index]);
    }
  }
  template <class Coefficients>
  [[gnu::noinline]] static void take_fields(FieldReader& reader, Coefficients& coefficients) {
    coefficients.fields(reader);
  }
  template <std::size_t Id>
  static constexpr Image image_of() {
    using Place = typename Model::template PlaceOf<Id>;
    if constexpr (Place::kExists) {
      return {&take_one<Id>, static_cast<std::uint8_t>(std::tuple_size_v<decltype(Place::places.coefficients)>)};
    } else {
      return {nullptr, 0};
    }
  }
  static constexpr auto kImage = []<std::size_t... Ids>(std::index_sequence<Ids...>) {
    return std::array<Image, effects::kLastId + 1>{image_of<Ids>()...};
  }
  (std::make_index_sequence<effects::kLastId + 1>{});

  Model* model_;
  std::uint8_t count_[effects::kLastId + 1]{};
};
}  // namespace detail

// The only validator. Checks the whole block: start, checksum, header, each entry, each field. Notes are ignored. With
// a model (of the image that is to run it, without effects) it fills that as well; `sections.take(kind, bytes)` returns
// the verdict of a section. If the block is not valid, what was read must not be used.
template <class Model, class Sections>
BlockVerdict read_block(std::span<const std::uint8_t> block, Model* model, Sections& sections) {
  if (const BlockVerdict v = check_start(block); !v.good()) return v;
  detail::EffectReader<Model> effects(model);
  const std::uint8_t* at = block.data() + detail::kBlockStart + detail::kHeaderBytes;
  const std::uint8_t* const end = block.data() + block.size() - detail::kChecksum;
  const auto entries = static_cast<std::int16_t>(detail::word_at(block.data() + 4) >> 16);
  for (std::int16_t entry = 0; entry < entries; ++entry) {
    if (end - at < static_cast<std::ptrdiff_t>(detail::kEntryHeader)) return {BlockFault::entry_cut_off, entry};
    const std::uint32_t kind = detail::word_at(at), length = detail::word_at(at + 4);
    at += detail::kEntryHeader;
    BlockVerdict v;
    if (kind > 0xFFFF) {  // what has to be zero
      v = {BlockFault::unknown_entry};
    } else if (length > static_cast<std::size_t>(end - at)) {
      v = {BlockFault::entry_cut_off};
    } else if (kind <= effects::kLastId) {
      v = effects.take(kind, {at, length});
    } else if (kind < 0x100) {
      v = {BlockFault::missing_effect};
    } else if (kind < kFirstNote) {
      v = sections.take(kind, {at, length});
    }
    if (!v.good()) {
      v.entry = entry;
      v.kind = static_cast<std::uint16_t>(kind);
      return v;
    }
    at += length;
  }
  if (at != end) return {BlockFault::wrong_length};
  return {};
}

// Writes a block, with integers only although only the host uses it. Entries are added between begin() and end().
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
    const auto number = [&](const Number& x) { put(writer_, x); };
    const auto limit = [&](const fixed::Value& x) { writer_.put(x.raw); };
    Bases bases = h.bases;
    Limits limits = h.limits;
    bases.fields(number);
    limits.fields(limit);
  }
  // An entry with the fields of a struct: coefficients of an effect, or a section.
  template <class T>
  constexpr void add(std::uint16_t kind, const T& object) {
    add(kind, std::span(&object, 1));
  }
  // The same, of each struct one after the other.
  template <class T>
  constexpr void add(std::uint16_t kind, std::span<const T> objects) {
    detail::put_entry(writer_, kind, [&](Writer& w) {
      for (const T& object : objects) write_fields(w, object);
    });
    ++entries_;
  }
  constexpr void add_bytes(std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    detail::put_entry(writer_, kind, [&](Writer& w) {
      for (const std::uint8_t byte : bytes) w.put(byte);
    });
    ++entries_;
  }
  // The total length, or zero where there was not enough room.
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
