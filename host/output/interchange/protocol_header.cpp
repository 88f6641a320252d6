#include "host/output/interchange/protocol_header.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <initializer_list>
#include <map>
#include <string_view>
#include <type_traits>
#include <vector>

#include "host/output/interchange/enumerators.hpp"
#include "shared/control/drive_block.hpp"
#include "shared/effects/list.hpp"
#include "shared/fixed/system.hpp"
#include "shared/model/block.hpp"
#include "shared/model/block_texts.hpp"
#include "shared/protocol/commissioning_payloads.hpp"
#include "shared/protocol/payloads.hpp"
#include "shared/protocol/serial_frame.hpp"
#include "shared/protocol/texts.hpp"
#include "shared/usb/identity.hpp"

namespace flexspline::interchange {
namespace {

std::string upper(std::string_view name) {
  std::string text;
  for (const char c : name) text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

// One field of a payload on the wire.
struct Place {
  std::size_t at;
  std::size_t width;  // bytes of an element
  std::size_t times;
  bool is_signed;
};

// A codec that writes down where fields go, in place of putting or taking them.
class Layout {
 public:
  template <class T>
  void operator()(T&) {
    add(std::is_same_v<T, bool> ? 1 : sizeof(T), 1, std::is_signed_v<T> && !std::is_same_v<T, bool>);
  }
  template <class T, std::size_t kSize>
  void operator()(std::array<T, kSize>&) {
    add(sizeof(T), kSize, std::is_signed_v<T>);
  }
  template <class T>
  void within(T& x, std::uint32_t) {
    (*this)(x);
  }
  template <class T, std::size_t kSize>
  void some(std::array<T, kSize>& all, std::uint8_t& count) {
    (*this)(count);
    if constexpr (std::is_class_v<T>) {
      Layout one;
      all[0].fields(one);
      add(1, one.size() * kSize, false);
    } else {
      (*this)(all);
    }
  }
  template <std::size_t kSize>
  void rest(std::array<std::uint8_t, kSize>& bytes, std::uint8_t&) {
    (*this)(bytes);
  }
  std::size_t size() const { return size_; }
  const std::vector<Place>& places() const { return places_; }

 private:
  void add(std::size_t width, std::size_t times, bool is_signed) {
    places_.push_back({size_, width, times, is_signed});
    size_ += width * times;
  }
  std::vector<Place> places_;
  std::size_t size_ = 0;
};

// The kinds of an entry's fields, as a validator's verdict counts them, and where each is in the entry.
class EntryLayout : public model::FieldNames<EntryLayout> {
 public:
  struct EntryField {
    std::size_t at = 0;
    model::Field kind{};
  };
  template <class Member>
  void integer(model::Field kind, Member&) {
    add(kind, model::kIntegers[static_cast<std::size_t>(kind)].bytes);
  }
  template <class Gain>
  void floating(model::Field kind, Gain&) {
    add(kind, 8);
  }
  void harmonic(fixed::Harmonic&) { add(model::Field::harmonic, 16); }
  template <class Words>
  void points(std::int16_t&, Words&) {
    add(model::Field::points, 4);
  }
  std::size_t bytes() const { return bytes_; }
  const std::vector<EntryField>& fields() const { return fields_; }

 private:
  void add(model::Field kind, std::size_t bytes) {
    fields_.push_back({bytes_, kind});
    bytes_ += bytes;
  }
  std::vector<EntryField> fields_;
  std::size_t bytes_ = 0;
};

class Writer {
 public:
  void line(std::string_view text = {}) { text_ += std::string(text) + "\n"; }
  void title(std::string_view text) { line(fmt::format("\n/* {} */", text)); }
  void number(std::string_view name, std::uint64_t value, std::string_view comment = {}) {
    line(fmt::format("#define FLEXSPLINE_{:<44} {}{}", upper(name),
                     value > 0xFFFF ? fmt::format("0x{:08X}u", value) : fmt::format("{}u", value),
                     comment.empty() ? "" : fmt::format(" /* {} */", comment)));
  }
  template <class Enum, std::size_t kFrom = 0, std::size_t kCount = 256, class Comment>
  void numbers(std::string_view prefix, Comment&& comment) {
    for_each_enumerator<Enum, kFrom, kCount>([&](std::string_view name, std::size_t value) {
      number(fmt::format("{}_{}", prefix, name), value, comment(static_cast<Enum>(value)));
    });
  }

  // A payload: offsets and a packed struct. `names` are of its fields in their order; a field that was added since and
  // has no name here yet is called by its place.
  template <class Payload>
  void payload(std::string_view name, std::string_view comment, std::initializer_list<std::string_view> names) {
    Layout layout;
    Payload empty{};
    empty.fields(layout);
    title(comment);
    std::string members;
    std::size_t i = 0;
    for (const Place& place : layout.places()) {
      const std::string field = i < names.size() ? std::string(names.begin()[i]) : fmt::format("field_{}", i);
      number(fmt::format("{}_{}_AT", name, field), place.at);
      members += fmt::format("  {}int{}_t {}{};\n", place.is_signed ? "" : "u", 8 * place.width, field,
                             place.times > 1 ? fmt::format("[{}]", place.times) : "");
      ++i;
    }
    number(fmt::format("{}_BYTES", name), layout.size());
    line(
        fmt::format("FLEXSPLINE_PACKED_BEGIN\ntypedef struct FLEXSPLINE_PACKED {{\n{}}} flexspline_{}_t;\n"
                    "FLEXSPLINE_PACKED_END",
                    members, name));
  }

  // Where the fields of an entry are.
  template <class T>
  void entry(std::string_view name) {
    EntryLayout layout;
    T object{};
    object.fields(layout);
    for (std::size_t i = 0; i < layout.fields().size(); ++i)
      number(fmt::format("{}_FIELD_{}_AT", name, i), layout.fields()[i].at, kind_name(layout.fields()[i].kind));
    number(fmt::format("{}_BYTES", name), layout.bytes());
  }
  const std::string& text() const { return text_; }

 private:
  static std::string kind_name(model::Field kind) {
    std::string found;
    for_each_enumerator<model::Field, 0, 32>([&](std::string_view name, std::size_t value) {
      if (value == static_cast<std::size_t>(kind)) found = name;
    });
    return found;
  }
  std::string text_;
};

constexpr auto kNoComment = [](auto) { return std::string_view(); };

void write_numbers(Writer& w) {
  using namespace protocol;
  w.title("The protocol. Messages are little-endian: kind, number, length of the payload, code, payload");
  w.number("PROTOCOL_MAJOR", kMajor);
  w.number("PROTOCOL_MINOR", kMinor);
  w.number("USB_VENDOR", usb::FlexsplineIdentity::kVendorId);
  w.number("USB_PRODUCT", usb::FlexsplineIdentity::kProductId);
  w.number("REPORT_BYTES", kReportBytes, "a message over HID, filled up with zeros");
  w.number("HEAD_BYTES", kHeadBytes);
  w.number("MOST_PAYLOAD", kMostPayload);
  w.number("HEAD_KIND_AT", 0);
  w.number("HEAD_NUMBER_AT", 1, "comes back with the answer; of telemetry: channels of a frame");
  w.number("HEAD_LENGTH_AT", 2);
  w.number("HEAD_CODE_AT", 3, "of an answer; of telemetry: how many frames");
  w.number("ANSWER_BIT", kAnswerBit, "an answer has the request's kind with this");
  w.number("FIRST_UNASKED", kFirstUnasked);
  w.number("MOST_CHANNELS", kMostChannels);
  w.number("MOST_SERIAL", kMostSerial, "bytes of a frame on a serial line: COBS of message and CRC-32, then a zero");
  w.title("Kinds of messages");
  w.numbers<Kind>("KIND", kNoComment);
  w.title("Codes of answers");
  w.numbers<Code>("CODE", [](Code code) { return text_of(code); });
  w.title("Modes of a drive");
  w.numbers<Mode>("MODE", kNoComment);
  w.title("Commands, and why one is refused");
  w.numbers<CommandKind, 0, kCommandKinds>("COMMAND", kNoComment);
  w.numbers<Refusal>("REFUSAL", [](Refusal refusal) { return text_of(refusal); });
  w.title("What a drive found of its stored blocks when it started");
  w.numbers<StoreState>("STORE", kNoComment);
  w.numbers<Which>("BLOCK", kNoComment);
  w.title("The lock of the parameters, and what a signature is for");
  w.numbers<PairingState>("PAIRING", kNoComment);
  w.numbers<PairingAction>("PAIRING_ACTION", kNoComment);
  w.title("Commissioning: how it ended, its steps, what it can find");
  w.numbers<CommissioningState>("COMMISSIONING", kNoComment);
  w.numbers<control::commissioning::Step>("COMMISSIONING_STEP", kNoComment);
  w.numbers<control::commissioning::Fault>("COMMISSIONING_FAULT", kNoComment);
  w.title("Channels of telemetry: 32-bit words, shares of a base (2^-27) where a unit is given");
  w.numbers<Channel>("CHANNEL", [](Channel channel) { return text_of(channel).unit; });
  w.title("Faults");
  for (std::uint8_t fault = 0; fault < kFaults; ++fault)
    w.number(fmt::format("FAULT_{}", fault_text(fault).name), fault, fault_text(fault).reason);
  w.title("Why a three-phase power stage switched itself off: the limit of an amplifier_fault");
  w.numbers<StageFault>("STAGE_FAULT",
                        [](StageFault fault) { return stage_fault_text(static_cast<std::int32_t>(fault)).reason; });
}

void write_commissioning_payloads(Writer& w) {
  using namespace protocol;
  w.payload<CommissioningStage>(
      "commissioning_stage", "commissioning_stage, from the drive: its power stage, and the motor in use",
      {"current_full_scale_ma", "bus_full_scale_mv", "pwm_hz", "timer_counts", "shortest_pulse", "most_current", "bus",
       "least_bus", "most_bus", "encoder_counts", "two_sensors", "pole_pairs", "reversed", "offset_angle"});
  w.payload<CommissioningBegin>(
      "commissioning_begin", "commissioning_begin, to the drive",
      {"least_bus", "current", "most_current", "most_voltage", "voltage_ramp", "slow_step", "fast_step",
       "most_shaft_step", "step_ramp", "most_travel", "most_periods", "stated_pole_pairs"});
  w.payload<CommissioningProgress>("commissioning_progress", "commissioning_state, from the drive",
                                   {"state", "step", "fault", "phase", "periods", "most_periods"});
  w.payload<CommissioningResult>("commissioning_result", "commissioning_result, from the drive",
                                 {"gain", "offset", "resistance", "inductance_d", "inductance_q", "flux",
                                  "lost_voltage", "pole_pairs", "reversed", "offset_angle", "lag"});
}

void write_payloads(Writer& w) {
  using namespace protocol;
  w.line(
      "\n/* Payloads: offsets from the payload's begin, and structs without padding for compilers that know how. */\n"
      "#if defined(__GNUC__) || defined(__clang__)\n#define FLEXSPLINE_PACKED_BEGIN\n#define FLEXSPLINE_PACKED "
      "__attribute__((packed))\n#define FLEXSPLINE_PACKED_END\n#else\n#define FLEXSPLINE_PACKED_BEGIN "
      "__pragma(pack(push, 1))\n#define FLEXSPLINE_PACKED\n#define FLEXSPLINE_PACKED_END __pragma(pack(pop))\n#endif");
  w.payload<Hello>("hello", "identify, to the drive", {"major", "minor"});
  w.payload<Identity>("identity", "identify, from the drive",
                      {"major", "minor", "firmware", "board", "serial", "tick_hz", "block_bytes", "effects", "channels",
                       "most_channels", "most_lines", "has_output_encoder", "firmware_key", "pairing"});
  w.payload<Effects>("effects", "effects, from the drive: bit n % 8 of byte n / 8", {"bits"});
  w.payload<Hardware>(
      "hardware", "hardware, from the drive: what its board states; zero where it does not",
      {"current_full_scale_ma", "amplifier_full_scale_ma", "most_current_ma", "torque_full_scale_mnm",
       "temperature_full_scale_mc", "temperature_at_zero_mc", "motor_encoder", "output_encoder", "torque_sensor"});
  w.payload<Reference>("reference", "reference, from the drive: what it knows of where its shafts are",
                       {"knows_turn", "knows_output", "motor_counts", "motor_zero", "motor_kind", "output_counts",
                        "output_zero", "output_kind"});
  w.payload<Home>("home", "home, to the drive: the motor's present position, 2^-32 turns", {"position"});
  w.payload<Status>("status", "status, from the drive",
                    {"tick", "mode", "has_parameters", "store", "fault", "fault_tick", "fault_seen", "fault_limit",
                     "dropped", "sequence", "staged", "active_bytes", "active_crc", "previous_bytes", "previous_crc"});
  w.payload<BlockBegin>("block_begin", "block_begin, to the drive", {"bytes", "crc"});
  w.payload<Chunk>("chunk", "block_chunk to the drive, block_read from it; as many bytes as the length states",
                   {"offset", "bytes"});
  w.payload<BlockRead>("block_read", "block_read, to the drive", {"which", "offset"});
  w.payload<BlockRestore>("block_restore", "block_restore, to the drive", {"sequence"});
  w.payload<Reason>("reason", "block_commit and block_restore, from the drive", {"reason"});
  w.payload<Command>("command", "command, to the drive",
                     {"kind", "mode", "compensate", "stream", "position", "velocity", "acceleration", "current"});
  w.payload<CommandAnswer>("command_answer", "command, from the drive", {"refusal", "mode"});
  w.payload<Excitation>("excitation", "excitation, to the drive",
                        {"shape", "is_torque", "line_count", "ticks", "fade_ticks", "step", "step_change", "positive",
                         "negative", "offset", "limit", "rate"});
  w.payload<ExcitationGuard>("excitation_guard", "excitation_guard, to the drive",
                             {"torque_limit", "overspeed", "largest_velocity", "slope_mantissa", "slope_exponent"});
  w.payload<ExcitationLine>("excitation_line", "a line of an excitation",
                            {"harmonic", "exponent", "mantissa", "phase"});
  w.payload<ExcitationLines>("excitation_lines", "excitation_lines, to the drive", {"first", "count", "lines"});
  w.payload<Subscription>("subscription", "telemetry, to the drive; without channels it ends",
                          {"every", "count", "channels"});
  w.payload<Pairing>("pairing", "pairing, from the drive", {"state", "wait_ms", "key"});
  w.payload<PairingChallenge>("pairing_challenge", "pairing_challenge, from the drive", {"nonce"});
  w.payload<PairingPart>("pairing_part", "pairing_part, to the drive: 0 the key, 1 and 2 the signature's halves",
                         {"part", "bytes"});
  w.payload<PairingAnswer>("pairing_answer", "pairing_answer, to the drive", {"action"});
  write_commissioning_payloads(w);
  w.payload<FrameHead>("frame_head", "telemetry_frames, from the drive; words of the frames follow",
                       {"sequence", "tick"});
}

// Where the fields of a block's header are.
void write_block_header(Writer& w) {
  namespace d = model::detail;
  std::size_t at = d::kBlockStart;
  w.number("BLOCK_DRIVE_NAME_AT", at);
  at += sizeof(model::Name);
  w.number("BLOCK_MODEL_NAME_AT", at);
  at += sizeof(model::Name);
  w.number("BLOCK_NAME_BYTES", sizeof(model::Name));
  w.number("BLOCK_AXIS_AT", at, "0 rotary, 1 linear");
  w.number("BLOCK_ENCODER_COUNTS_AT", at + 4);
  at += 8;
  for (const std::string_view base :
       {"gear_ratio", "torque_constant", "rated_velocity", "reference_temperature", "turn_angle_scale", "torque",
        "output_torque", "velocity", "output_velocity", "acceleration", "output_acceleration", "angle", "torsion",
        "torsion_rate", "temperature", "current", "time"}) {
    w.number(fmt::format("BASE_{}_AT", base), at, "number");
    at += 8;
  }
  for (const std::string_view limit :
       {"torque", "load", "velocity", "overspeed", "current", "torsion", "direction_band"}) {
    w.number(fmt::format("LIMIT_{}_AT", limit), at, "value");
    at += 4;
  }
}

void write_effect_entries(Writer& w) {
  w.title(
      "Entries of effects: their number, and where their coefficients are; behind the last a table has its points, 4 "
      "bytes each");
  using Image = decltype(control::DriveParameters<fixed::Fixed>::model);
  const auto image = std::make_unique<const Image>();
  std::map<std::size_t, std::string_view> names;
  effects::for_each_effect([&]<class Effect>(std::size_t id) { names.emplace(id, Effect::kInfo.name); });
  for (const auto& [id, effect] : names) {
    const std::string name = fmt::format("EFFECT_{}", effect);
    w.number(name, id);
    image->for_each([&, number = id]<class Effect>(const auto&) {
      if (Image::number_of<Effect>() == number) w.entry<typename Effect::template Coefficients<fixed::Fixed>>(name);
    });
  }
}

void write_block(Writer& w) {
  namespace d = model::detail;
  w.title("The parameter block. A number is an int32 mantissa and an int32 exponent: mantissa 2^(exponent - 30)");
  w.number("BLOCK_MAGIC", model::kBlockMagic);
  w.number("BLOCK_VERSION", model::kBlockVersion);
  w.number("LARGEST_BLOCK", model::kLargestBlock);
  w.number("MOST_ENTRIES", model::kMostEntries);
  w.number("VALUE_FRACTION_BITS", fixed::kValueBits, "a value is an int32 in 2^-27 of its base");
  w.number("BLOCK_MAGIC_AT", 0);
  w.number("BLOCK_VERSION_AT", 4);
  w.number("BLOCK_ENTRY_COUNT_AT", 6);
  w.number("BLOCK_TOTAL_BYTES_AT", 8);
  write_block_header(w);
  w.number("BLOCK_ENTRIES_AT", d::kBlockStart + d::kHeaderBytes, "uint16 kind, uint16 zero, uint32 bytes, bytes");
  w.number("ENTRY_HEAD_BYTES", d::kEntryHeader);
  w.number("BLOCK_CHECKSUM_BYTES", d::kChecksum, "CRC-32 of all before it, at the end");
  w.number("FIRST_NOTE", model::kFirstNote, "entries from here on are for people and hosts");
  w.title("A validator's verdict on a block");
  w.numbers<model::BlockFault>("REASON", [](model::BlockFault fault) { return model::text_of(fault); });
  write_effect_entries(w);
  w.title("Entries of sections");
  for_each_enumerator<model::Section, 0x100, 0x40>([&](std::string_view name, std::size_t value) {
    const std::string section = fmt::format("SECTION_{}", name);
    w.number(section, value);
    control::detail::for_each_section([&]<class S>(S) {
      if (static_cast<std::size_t>(S::kKind) == value) w.entry<typename S::Data>(section);
    });
  });
}

}  // namespace

std::string protocol_header(const std::string& made_by) {
  Writer w;
  w.line(
      fmt::format("/* Messages and parameter block of a Flexspline drive. Made by {}:\n * flexspline export "
                  "--protocol-header. Do not edit.\n */\n#ifndef FLEXSPLINE_PROTOCOL_H\n#define "
                  "FLEXSPLINE_PROTOCOL_H\n\n#include <stdint.h>",
                  made_by));
  write_numbers(w);
  write_payloads(w);
  write_block(w);
  w.line("\n#endif /* FLEXSPLINE_PROTOCOL_H */");
  return w.text();
}

}  // namespace flexspline::interchange
