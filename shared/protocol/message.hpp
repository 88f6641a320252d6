// A message between a host and a drive, over any link: at most 64 bytes, little-endian.
//
//   0  kind     of a request, below 0x70; an answer has the same with kAnswerBit;
//               from kFirstUnasked on messages that a drive sends by itself
//   1  number   of the request, any; the answer repeats it
//   2  length   of the payload, 0 to 60
//   3  code     of an answer; otherwise zero (of telemetry: the number of frames)
//   4  payload
//
// A report of 64 bytes is filled up with zeros.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "shared/model/encoding.hpp"

namespace flexspline::protocol {

inline constexpr std::uint8_t kMajor = 1;  // with another one only `identify` is understood
// Increases with each addition: 1 the residual map, 2 the board's hardware and the angles of the shafts, 3 the key of
// the firmware, 4 the stored zero, 5 the pairing key, 6 commissioning.
inline constexpr std::uint8_t kMinor = 6;

inline constexpr std::uint8_t kMinorOfHardware = 2;
inline constexpr std::uint8_t kMinorOfZero = 4;
inline constexpr std::uint8_t kMinorOfPairing = 5;
inline constexpr std::uint8_t kMinorOfCommissioning = 6;

inline constexpr std::size_t kReportBytes = 64;
inline constexpr std::size_t kHeadBytes = 4;
inline constexpr std::size_t kMostPayload = kReportBytes - kHeadBytes;
using Report = std::array<std::uint8_t, kReportBytes>;

inline constexpr std::uint8_t kAnswerBit = 0x80;
inline constexpr std::uint8_t kEndOfRequests = 0x70;
inline constexpr std::uint8_t kFirstUnasked = kAnswerBit + kEndOfRequests;

// Numbers never change; that of a removed kind is not reused.
enum class Kind : std::uint8_t {
  identify = 0x01,
  status = 0x02,
  effects = 0x03,
  hardware = 0x04,
  reference = 0x05,
  home = 0x06,
  block_begin = 0x10,
  block_chunk = 0x11,
  block_commit = 0x12,
  block_restore = 0x13,
  block_read = 0x14,
  block_erase_all = 0x15,
  command = 0x20,
  excitation = 0x21,
  excitation_guard = 0x22,
  excitation_lines = 0x23,
  excitation_use = 0x24,
  telemetry = 0x30,
  map_info = 0x40,  // the residual map: map_payloads.hpp
  map_bins = 0x41,
  map_command = 0x42,
  pairing = 0x50,  // the lock of the parameters: pairing_payloads.hpp
  pairing_challenge = 0x51,
  pairing_part = 0x52,
  pairing_answer = 0x53,
  pairing_remove = 0x54,
  pairing_lock = 0x55,
  commissioning_stage = 0x60,  // the measurement of a three-phase motor: commissioning_payloads.hpp
  commissioning_begin = 0x61,
  commissioning_stop = 0x62,
  commissioning_state = 0x63,
  commissioning_result = 0x64,
  telemetry_frames = kFirstUnasked,
};

enum class Code : std::uint8_t {
  done,
  unknown_request,  // this drive does not know it
  wrong_length,
  wrong_value,    // a number is outside what its field may hold
  wrong_version,  // `identify` with an agreeing major has to come first
  busy,           // the previous request has not been answered
  armed,          // not while the drive is armed
  refused,        // a command; the payload says why
  no_parameters,
  no_block,
  not_available,  // this drive cannot do that
  moving,         // not while the shaft turns
  locked,         // by a pairing key, which this host has not shown
  not_paired,
  other_key,        // the drive is paired with another key
  wrong_signature,  // or there is no challenge that it could be for
  wait,             // after a wrong signature; `pairing` says how long
  pairing_full,     // no room to record another key
  not_measured,     // since its start the drive has not measured its motor
  // Of the parameter store, in its order.
  too_long = 0x20,
  not_begun,
  out_of_order,
  incomplete,
  wrong_checksum,
  invalid,  // the validator refused it; the payload has its reason
  flash,
  no_previous,
  worn,
};

struct Message {
  std::uint8_t kind = 0;
  std::uint8_t number = 0;
  std::uint8_t length = 0;
  std::uint8_t code = 0;
  std::array<std::uint8_t, kMostPayload> payload{};

  constexpr Kind request() const { return static_cast<Kind>(kind & ~kAnswerBit); }
  constexpr bool is_request() const { return kind < kEndOfRequests; }
  constexpr bool is_unasked() const { return kind >= kFirstUnasked; }
  constexpr bool is_answer() const { return kind >= kAnswerBit && !is_unasked(); }
  constexpr std::size_t size() const { return kHeadBytes + length; }
  constexpr std::span<const std::uint8_t> content() const { return std::span(payload).first(length); }
};

// The first size() bytes count; the rest are zeros.
constexpr Report encode(const Message& m) {
  Report report{};
  report[0] = m.kind;
  report[1] = m.number;
  report[2] = m.length;
  report[3] = m.code;
  for (std::size_t i = 0; i < m.length && i < kMostPayload; ++i) report[kHeadBytes + i] = m.payload[i];
  return report;
}
// False for a message that is cut off or states a length that does not fit. Bytes after the message are ignored.
constexpr bool decode(std::span<const std::uint8_t> bytes, Message& m) {
  if (bytes.size() < kHeadBytes) return false;
  const std::uint8_t length = bytes[2];
  if (length > kMostPayload || bytes.size() < kHeadBytes + length) return false;
  m = {bytes[0], bytes[1], length, bytes[3], {}};
  for (std::size_t i = 0; i < length; ++i) m.payload[i] = bytes[kHeadBytes + i];
  return true;
}

// A payload names its fields once, in their order on the wire, for both directions:
//   template <class Codec> constexpr void fields(Codec& c) { c(number); c.within(kind, 5); }
class PutFields {
 public:
  explicit constexpr PutFields(std::span<std::uint8_t> room) : writer_(room) {}
  template <class T>
  constexpr void operator()(T& x) {
    if constexpr (std::is_same_v<T, bool>) {
      writer_.put(static_cast<std::uint8_t>(x));
    } else {
      writer_.put(x);
    }
  }
  template <class T, std::size_t Size>
  constexpr void operator()(std::array<T, Size>& all) {
    for (T& x : all) (*this)(x);
  }
  // An integer or enumeration below `end`.
  template <class T>
  constexpr void within(T& x, std::uint32_t) {
    (*this)(x);
  }
  // The first `count` of `all`; a byte before them has their number.
  template <class T, std::size_t Size>
  constexpr void some(std::array<T, Size>& all, std::uint8_t& count) {
    writer_.put(count);
    for (std::size_t i = 0; i < count && i < Size; ++i) one(all[i]);
  }
  // Bytes up to the end of the message.
  template <std::size_t Size>
  constexpr void rest(std::array<std::uint8_t, Size>& bytes, std::uint8_t& count) {
    for (std::size_t i = 0; i < count && i < Size; ++i) writer_.put(bytes[i]);
  }
  constexpr std::size_t size() const { return writer_.size(); }
  constexpr bool good() const { return writer_.fits(); }

 private:
  template <class T>
  constexpr void one(T& x) {
    if constexpr (std::is_class_v<T>) {
      x.fields(*this);
    } else {
      (*this)(x);
    }
  }
  model::Writer writer_;
};
class TakeFields {
 public:
  explicit constexpr TakeFields(std::span<const std::uint8_t> bytes) : reader_(bytes) {}
  template <class T>
  constexpr void operator()(T& x) {
    if constexpr (std::is_same_v<T, bool>) {
      const auto byte = reader_.take<std::uint8_t>();
      x = byte != 0;
      in_range_ = in_range_ && byte <= 1;
    } else {
      x = reader_.take<T>();
    }
  }
  template <class T, std::size_t Size>
  constexpr void operator()(std::array<T, Size>& all) {
    for (T& x : all) (*this)(x);
  }
  template <class T>
  constexpr void within(T& x, std::uint32_t end) {
    const auto raw = reader_.take<T>();
    const bool fits = static_cast<std::uint32_t>(raw) < end;
    x = fits ? raw : T{};
    in_range_ = in_range_ && fits;
  }
  template <class T, std::size_t Size>
  constexpr void some(std::array<T, Size>& all, std::uint8_t& count) {
    within(count, Size + 1);
    for (std::size_t i = 0; i < count; ++i) one(all[i]);
  }
  template <std::size_t Size>
  constexpr void rest(std::array<std::uint8_t, Size>& bytes, std::uint8_t& count) {
    count = static_cast<std::uint8_t>(reader_.left() < Size ? reader_.left() : Size);
    for (std::size_t i = 0; i < count; ++i) bytes[i] = reader_.take<std::uint8_t>();
  }
  constexpr bool whole() const { return reader_.whole() && reader_.left() == 0; }
  constexpr bool long_enough() const { return reader_.whole(); }
  constexpr bool in_range() const { return in_range_; }

 private:
  template <class T>
  constexpr void one(T& x) {
    if constexpr (std::is_class_v<T>) {
      x.fields(*this);
    } else {
      (*this)(x);
    }
  }
  model::Reader reader_;
  bool in_range_ = true;
};

template <class Payload>
constexpr void put_payload(Message& m, const Payload& payload) {
  PutFields put(m.payload);
  Payload copy = payload;
  copy.fields(put);
  m.length = static_cast<std::uint8_t>(put.good() ? put.size() : 0);
}
// `done`, `wrong_length` where the bytes are not those of a whole payload, or `wrong_value`.
template <class Payload>
constexpr Code take_payload(std::span<const std::uint8_t> bytes, Payload& payload) {
  TakeFields take(bytes);
  payload.fields(take);
  if (!take.whole()) return Code::wrong_length;
  return take.in_range() ? Code::done : Code::wrong_value;
}
// The same for `identify`, to which a later version may have appended more.
template <class Payload>
constexpr Code take_front(std::span<const std::uint8_t> bytes, Payload& payload) {
  TakeFields take(bytes);
  payload.fields(take);
  return take.long_enough() ? Code::done : Code::wrong_length;
}

template <class Payload>
constexpr Message request(Kind kind, std::uint8_t number, const Payload& payload) {
  Message m{static_cast<std::uint8_t>(kind), number, 0, 0, {}};
  put_payload(m, payload);
  return m;
}
constexpr Message answer_to(const Message& request, Code code) {
  return {static_cast<std::uint8_t>(request.kind | kAnswerBit), request.number, 0, static_cast<std::uint8_t>(code), {}};
}
template <class Payload>
constexpr Message answer_to(const Message& request, Code code, const Payload& payload) {
  Message m = answer_to(request, code);
  put_payload(m, payload);
  return m;
}

}  // namespace flexspline::protocol
