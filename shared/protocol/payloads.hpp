// Payloads of the messages. Fields are sent in the order of fields(), little-endian, each as wide as its type.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shared/control/excitation_setup.hpp"
#include "shared/control/hardware.hpp"
#include "shared/protocol/message.hpp"
#include "shared/protocol/pairing_payloads.hpp"
#include "shared/protocol/states.hpp"

namespace flexspline::protocol {

inline constexpr std::size_t kMostChannels = 12;

struct Empty {
  template <class Codec>
  constexpr void fields(Codec&) {}
  bool operator==(const Empty&) const = default;
};

// `identify`, both ways. These two layouts never change in any version; further bytes are ignored.
struct Hello {
  std::uint8_t major = kMajor;
  std::uint8_t minor = kMinor;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(major), c(minor);
  }
  bool operator==(const Hello&) const = default;
};
// Whose images the drive's boot loader takes. Not stated: by firmware before protocol 1.3.
enum class FirmwareKey : std::uint8_t { not_stated, none, development, own };
inline constexpr std::size_t kFirmwareKeys = 4;
// Of an identity without it; and of a whole one, to which the state of the pairing was added.
inline constexpr std::size_t kIdentityBytesBeforeKey = 50, kIdentityBytes = 52;

struct Identity {
  std::uint8_t major = kMajor;
  std::uint8_t minor = kMinor;
  std::array<std::uint8_t, 2> firmware{};  // version
  std::array<std::uint8_t, 16> board{};    // names: ASCII, zeros behind
  std::array<std::uint8_t, 16> serial{};
  std::uint32_t tick_hz = 0;
  std::uint32_t block_bytes = 0;   // the longest parameter block
  std::uint16_t effects = 0;       // that the image has; `effects` lists them
  std::uint8_t channels = 0;       // of telemetry that it knows
  std::uint8_t most_channels = 0;  // in one subscription
  std::uint8_t most_lines = 0;     // of an excitation
  std::uint8_t has_output_encoder = 0;
  FirmwareKey firmware_key = FirmwareKey::not_stated;
  PairingState pairing = PairingState::not_stated;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(major), c(minor), c(firmware), c(board), c(serial), c(tick_hz), c(block_bytes), c(effects), c(channels),
        c(most_channels), c(most_lines), c(has_output_encoder);
    c.within(firmware_key, kFirmwareKeys), c.within(pairing, kPairingStates);
  }
  bool operator==(const Identity&) const = default;
};

// Which effects the image has, by their numbers: bit n % 8 of byte n / 8.
struct Effects {
  std::array<std::uint8_t, 32> bits{};
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(bits);
  }
  constexpr bool has(std::uint8_t n) const { return (bits[n / 8] >> (n % 8) & 1) != 0; }
  bool operator==(const Effects&) const = default;
};

// What the board states about its hardware.
struct Hardware {
  control::Hardware board{};
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(board.current_full_scale_ma), c(board.amplifier_full_scale_ma), c(board.most_current_ma);
    c(board.torque_full_scale_mnm), c(board.temperature_full_scale_mc), c(board.temperature_at_zero_mc);
    c.within(board.motor_encoder, control::kSensorKinds), c.within(board.output_encoder, control::kSensorKinds);
    c.within(board.torque_sensor, control::kSensorKinds);
  }
  bool operator==(const Hardware&) const = default;
};

inline constexpr std::size_t kReferenceBytesBeforeZero = 2, kReferenceBytes = 26;
// Which angles of its shafts a drive knows.
struct Reference {
  bool knows_turn = false;    // of the motor: effects that repeat with it act
  bool knows_output = false;  // effects of the output's angle act, and limits of position
  // After `home`: what the encoders show at the zeros of their shafts. Zero counts: of an encoder whose reading says
  // nothing after the next power-on. Not sent before protocol 1.4.
  control::StoredZero zero{};
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(knows_turn), c(knows_output);
    for (control::StoredZero::Place* place : {&zero.motor, &zero.output})
      c(place->counts), c(place->reading), c(place->kind);
  }
  bool operator==(const Reference&) const = default;
};
// `home`: the motor's present angle, 2^-32 turns; answered as a command is.
struct Home {
  std::int64_t position = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(position);
  }
  bool operator==(const Home&) const = default;
};

struct StoredBlock {
  std::uint32_t bytes = 0;  // zero: there is none
  std::uint32_t crc = 0;    // of these bytes, CRC-32
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(bytes), c(crc);
  }
  bool operator==(const StoredBlock&) const = default;
};
struct Status {
  std::uint32_t tick = 0;
  Mode mode = Mode::boot;
  bool has_parameters = false;
  StoreState store = StoreState::empty;
  std::uint8_t fault = 0;  // the present fault, or the last one
  std::uint32_t fault_tick = 0;
  std::int32_t fault_seen = 0;
  std::int32_t fault_limit = 0;
  std::uint32_t dropped = 0;   // frames of telemetry that the drive dropped because its ring was full
  std::uint16_t sequence = 0;  // of the active block: another one with each commit and restore
  std::uint32_t staged = 0;    // bytes
  StoredBlock active{};
  StoredBlock previous{};
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(tick), c.within(mode, kModes), c(has_parameters), c.within(store, kStoreStates), c.within(fault, kFaults);
    c(fault_tick), c(fault_seen), c(fault_limit), c(dropped), c(sequence), c(staged);
    active.fields(c), previous.fields(c);
  }
  bool operator==(const Status&) const = default;
};

struct BlockBegin {
  std::uint32_t bytes = 0;
  std::uint32_t crc = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(bytes), c(crc);
  }
  bool operator==(const BlockBegin&) const = default;
};
// A chunk of a block, both ways. The longest is a multiple of four bytes, as flash is written in words.
inline constexpr std::size_t kMostChunk = kMostPayload - 4;
static_assert(kMostChunk % 4 == 0);
struct Chunk {
  std::uint32_t offset = 0;
  std::array<std::uint8_t, kMostChunk> bytes{};
  std::uint8_t count = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(offset), c.rest(bytes, count);
  }
  bool operator==(const Chunk&) const = default;
};
enum class Which : std::uint8_t { active, previous };
struct BlockRead {
  Which which = Which::active;
  std::uint32_t offset = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(which, 2), c(offset);
  }
  bool operator==(const BlockRead&) const = default;
};
// `sequence` as in the status: a restore that is requested twice, because an answer was lost, is done once.
struct BlockRestore {
  std::uint16_t sequence = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(sequence);
  }
  bool operator==(const BlockRestore&) const = default;
};
// Answer to commit and restore: the validator's reason, zero for a valid block.
struct Reason {
  std::uint32_t reason = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(reason);
  }
  bool operator==(const Reason&) const = default;
};

// Set points per unit of the active block's bases: 2^-27 of a base, angles 2^-32 turns of the motor.
struct Command {
  CommandKind kind = CommandKind::heartbeat;
  Mode mode = Mode::idle;
  bool compensate = false;
  bool stream = false;
  std::int64_t position = 0;
  std::int32_t velocity = 0;
  std::int32_t acceleration = 0;
  std::int32_t current = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(kind, kCommandKinds), c.within(mode, kModes), c(compensate), c(stream);
    c(position), c(velocity), c(acceleration), c(current);
  }
  bool operator==(const Command&) const = default;
};
struct CommandAnswer {
  Refusal refusal = Refusal::none;
  Mode mode = Mode::boot;  // after the command
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(refusal, kRefusals), c.within(mode, kModes);
  }
  bool operator==(const CommandAnswer&) const = default;
};

// An excitation in the drive's own numbers (shared/control/excitation.hpp); guard and lines go before `excitation_use`.
struct Excitation {
  static constexpr std::uint32_t kShapes = 5;
  control::Shape shape = control::Shape::lines;
  bool is_torque = true;  // else a velocity
  std::uint8_t line_count = 0;
  std::uint32_t ticks = 0;
  std::uint32_t fade_ticks = 0;
  std::uint64_t step = 0;
  std::uint64_t step_change = 0;
  std::int32_t positive = 0;
  std::int32_t negative = 0;
  std::int32_t offset = 0;
  std::int32_t limit = 0;
  std::int64_t rate = 0;  // of the limiter, a state's bits a tick
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(shape, kShapes), c(is_torque), c.within(line_count, control::kMostLines + 1);
    c(ticks), c(fade_ticks), c(step), c(step_change);
    c(positive), c(negative), c(offset), c(limit), c(rate);
  }
  bool operator==(const Excitation&) const = default;
};
struct ExcitationGuard {
  std::int32_t torque_limit = 0;
  std::int32_t overspeed = 0;
  std::int32_t largest_velocity = 0;
  std::int32_t slope_mantissa = 0;
  std::int32_t slope_exponent = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(torque_limit), c(overspeed), c(largest_velocity), c(slope_mantissa), c(slope_exponent);
  }
  bool operator==(const ExcitationGuard&) const = default;
};
struct ExcitationLine {
  std::uint16_t harmonic = 0;
  std::int16_t exponent = 0;
  std::int32_t mantissa = 0;
  std::uint32_t phase = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(harmonic), c(exponent), c(mantissa), c(phase);
  }
  bool operator==(const ExcitationLine&) const = default;
};
inline constexpr std::size_t kLinesAMessage = 4;
struct ExcitationLines {
  std::uint8_t first = 0;
  std::array<ExcitationLine, kLinesAMessage> lines{};
  std::uint8_t count = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(first, control::kMostLines), c.some(lines, count);
  }
  bool operator==(const ExcitationLines&) const = default;
};

// Begins, changes or (with no channels) ends the telemetry; sequence and drops start from zero.
struct Subscription {
  std::uint16_t every = 1;  // ticks
  std::array<Channel, kMostChannels> channels{};
  std::uint8_t count = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(every), c.some(channels, count);
  }
  bool operator==(const Subscription&) const = default;
};
// One frame or several that follow each other without a gap: frame i has sequence + i and the tick + i * every. In the
// message's head, `number` is how many channels a frame has and `code` how many frames there are.
struct FrameHead {
  std::uint32_t sequence = 0;
  std::uint32_t tick = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(sequence), c(tick);
  }
  bool operator==(const FrameHead&) const = default;
};
inline constexpr std::size_t kFrameHeadBytes = 8;
constexpr std::size_t frames_a_message(std::size_t channels) {
  return channels == 0 ? 0 : (kMostPayload - kFrameHeadBytes) / (4 * channels);
}
static_assert(frames_a_message(kMostChannels) >= 1);
// Calls visit(sequence, index of the frame, words) for each frame. False for a message that does not contain whole
// frames.
template <class Visit>
constexpr bool for_each_frame(const Message& m, Visit&& visit) {
  const std::size_t channels = m.number, frames = m.code;
  if (m.request() != static_cast<Kind>(kFirstUnasked & ~kAnswerBit) || channels == 0 || channels > kMostChannels)
    return false;
  if (frames == 0 || m.length != kFrameHeadBytes + 4 * channels * frames) return false;
  model::Reader r(m.content());
  FrameHead head;
  head.sequence = r.take<std::uint32_t>();
  head.tick = r.take<std::uint32_t>();
  std::array<std::uint32_t, kMostChannels> words{};
  for (std::uint32_t i = 0; i < frames; ++i) {
    for (std::size_t k = 0; k < channels; ++k) words[k] = r.take<std::uint32_t>();
    visit(head, i, std::span<const std::uint32_t>(words).first(channels));
  }
  return true;
}

}  // namespace flexspline::protocol
