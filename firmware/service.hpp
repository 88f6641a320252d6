// Serves a host: takes messages, answers them, sends telemetry. Runs in background work; the tick does not depend on
// it. Every link, USB or serial, hands over whole messages and fetches whole messages.
//
// The rights of a host are checked here and in Application: parameters and excitation change only while the drive is
// not armed; what writes is refused while a pairing key locks the parameters; commands go through the application's
// mailbox, which arms from `idle` and from one armed mode to another.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "firmware/application.hpp"
#include "firmware/commissioning_messages.hpp"
#include "firmware/excitation_intake.hpp"
#include "firmware/map_messages.hpp"
#include "firmware/pairing_messages.hpp"
#include "firmware/parameter_lock.hpp"
#include "firmware/telemetry_messages.hpp"
#include "shared/protocol/payloads.hpp"
#include "shared/storage/parameter_store.hpp"

namespace flexspline::firmware {

// Validates blocks and applies the active one. validate() returns a reason, zero for a valid block.
template <class B>
concept BlockUser = requires(B blocks, std::span<const std::uint8_t> block) {
  { blocks.validate(block) } -> std::convertible_to<std::uint32_t>;  // in place, without a copy
  blocks.adopt(block);                                               // begins; the block has to stay in place
  { blocks.adopted() } -> std::same_as<std::optional<std::uint32_t>>;
};

// With the functions of the application.
template <class Application, std::uint32_t kTickHz>
class ApplicationBlocks {
 public:
  explicit ApplicationBlocks(Application& application) : application_(application) {}
  std::uint32_t validate(std::span<const std::uint8_t> block) const {
    return static_cast<std::uint32_t>(application_.check(std::as_bytes(block)));
  }
  void adopt(std::span<const std::uint8_t> block) { application_.offer(std::as_bytes(block)); }
  std::optional<std::uint32_t> adopted() const {
    const auto finding = application_.block_finding();
    if (!finding) return {};
    return static_cast<std::uint32_t>(*finding);
  }

 private:
  Application& application_;
};

// What does not change while the drive runs.
struct DriveInfo {
  std::array<std::uint8_t, 2> firmware{};  // version
  std::array<std::uint8_t, 16> board{};    // ASCII, zeros to the end; at most 15 characters
  std::array<std::uint8_t, 16> serial{};
  protocol::FirmwareKey key = protocol::FirmwareKey::none;
  static constexpr DriveInfo of(std::array<std::uint8_t, 2> version, std::string_view board, std::string_view serial,
                                protocol::FirmwareKey key = protocol::FirmwareKey::none) {
    DriveInfo info{version, {}, {}, key};
    for (std::size_t i = 0; i < board.size() && i + 1 < info.board.size(); ++i)
      info.board[i] = static_cast<std::uint8_t>(board[i]);
    for (std::size_t i = 0; i < serial.size() && i + 1 < info.serial.size(); ++i)
      info.serial[i] = static_cast<std::uint8_t>(serial[i]);
    return info;
  }
};

static_assert(protocol::kMostChannels == TelemetrySetup::kMost);
static_assert(static_cast<int>(protocol::Code::worn) - static_cast<int>(protocol::Code::too_long) + 1 ==
              static_cast<int>(storage::StoreError::worn));

template <class Application, class Store, BlockUser Blocks, class Lock = NoLock>
class Service {
 public:
  Service(Application& application, Store& store, Blocks& blocks, std::uint32_t tick_hz, const DriveInfo& info,
          Lock& lock)
      : application_(application), store_(store), blocks_(blocks), lock_(lock), tick_hz_(tick_hz), info_(info) {}

  // Before the first tick: applies the newest valid block of the store.
  void start() {
    lock_.start({info_.board, info_.serial});
    store_.boot(validator());
    if (!store_.active().empty()) blocks_.adopt(store_.active());
  }
  // The link was lost or is new: the next host has to identify itself, and does not get the telemetry of the previous
  // one.
  void disconnected() {
    agreed_ = false;
    has_answer_ = false;
    lock_.close();
    application_.commissioning().lose_host();
    frames_.restart();
    application_.telemetry().configure({});
  }

  // A received message. False: there is no room for its answer yet, offer it again later.
  bool take(const protocol::Message& m) {
    if (has_answer_) return false;
    if (!m.is_request()) return true;
    application_.commissioning().note_host();
    if (waits_for_ != Wait::none) {
      answer(protocol::answer_to(m, protocol::Code::busy));
      return true;
    }
    if (!agreed_ && m.request() != protocol::Kind::identify) {
      answer(protocol::answer_to(m, protocol::Code::wrong_version));
      return true;
    }
    request_ = protocol::answer_to(m, protocol::Code::done);
    if (lock_.admits(m, application_.snapshot().tick)) {
      serve(m);
    } else {
      finish(protocol::Code::locked);
    }
    return true;
  }
  // The next message to send, if there is one: answers before telemetry.
  bool next(protocol::Message& m) {
    if (has_answer_) {
      m = answer_;
      has_answer_ = false;
      return true;
    }
    return frames_.next(application_, m);
  }
  // Call repeatedly, after Application::background().
  void background() {
    lock_.watch(application_.snapshot().tick);
    if (has_answer_) return;  // to a request that was refused meanwhile: it is sent first
    if (waits_for_ == Wait::room) {
      if (application_.submit(command_)) waits_for_ = Wait::command;
    } else if (waits_for_ == Wait::command) {
      const auto got = application_.answer();
      if (!got || got->number != command_.number) return;
      waits_for_ = Wait::none;
      const protocol::CommandAnswer payload{got->refusal, got->mode};
      finish(got->refusal == Refusal::none ? protocol::Code::done : protocol::Code::refused, payload);
    } else if (waits_for_ == Wait::adoption) {
      const auto reason = blocks_.adopted();
      // The block was taken or refused, and the tick has the parameters again.
      if (!reason || (*reason == 0 && !application_.status().has_parameters)) return;
      waits_for_ = Wait::none;
      finish(*reason == 0 ? protocol::Code::done : protocol::Code::invalid, protocol::Reason{*reason});
    }
  }

 private:
  using Kind = protocol::Kind;
  using Code = protocol::Code;
  enum class Wait : std::uint8_t { none, room, command, adoption };

  auto validator() {
    return [this](std::span<const std::uint8_t> block) { return blocks_.validate(block); };
  }
  bool armed() const { return is_live(application_.status().mode); }

  void answer(const protocol::Message& m) {
    answer_ = m;
    has_answer_ = true;
  }
  void finish(Code code) {
    request_.code = static_cast<std::uint8_t>(code);
    answer(request_);
  }
  template <class Payload>
  void finish(Code code, const Payload& payload) {
    protocol::put_payload(request_, payload);
    finish(code);
  }
  // Decodes the payload; if it is not valid, answers so and returns false.
  template <class Payload>
  bool taken(const protocol::Message& m, Payload& payload) {
    const Code code = protocol::take_payload(m.content(), payload);
    if (code != Code::done) finish(code);
    return code == Code::done;
  }
  static Code code_of(storage::StoreError error) {
    if (error == storage::StoreError::none) return Code::done;
    return static_cast<Code>(static_cast<int>(Code::too_long) + static_cast<int>(error) - 1);
  }

  void serve(const protocol::Message& m) {
    switch (m.request()) {
      case Kind::identify:
        return identify(m);
      case Kind::status:
      case Kind::effects:
      case Kind::hardware:
      case Kind::reference:
      case Kind::block_commit:
      case Kind::block_erase_all:
      case Kind::map_info: {
        if (protocol::Empty empty; !taken(m, empty)) return;
        if (m.request() == Kind::status) return status();
        if (m.request() == Kind::effects) return effects();
        if (m.request() == Kind::reference) return reference();
        if (m.request() == Kind::hardware) return finish(Code::done, protocol::Hardware{application_.hardware()});
        if (m.request() == Kind::map_info) return map_info();
        if (m.request() == Kind::block_erase_all) return erase_all_blocks();
        return commit();
      }
      case Kind::block_begin:
        return begin_block(m);
      case Kind::block_chunk:
        return take_chunk(m);
      case Kind::block_restore:
        return restore(m);
      case Kind::block_read:
        return read_block(m);
      case Kind::command:
        return command(m);
      case Kind::home:
        return home(m);
      case Kind::excitation:
      case Kind::excitation_guard:
      case Kind::excitation_lines:
      case Kind::excitation_use:
        return finish(excitation_.take(application_, m));
      case Kind::telemetry:
        return telemetry(m);
      case Kind::map_bins:
        return map_bins(m);
      case Kind::map_command:
        return map_command(m);
      case Kind::pairing:
      case Kind::pairing_challenge:
      case Kind::pairing_part:
      case Kind::pairing_answer:
      case Kind::pairing_remove:
      case Kind::pairing_lock:
        return finish(PairingMessages::serve(application_, lock_, m, request_));
      case Kind::commissioning_stage:
      case Kind::commissioning_begin:
      case Kind::commissioning_stop:
      case Kind::commissioning_state:
      case Kind::commissioning_result:
        return commissioning(m);
      default:
        return finish(Code::unknown_request);
    }
  }

  void identify(const protocol::Message& m) {
    protocol::Hello hello;
    const Code code = protocol::take_front(m.content(), hello);
    agreed_ = code == Code::done && hello.major == protocol::kMajor;
    lock_.close();  // a host begins with this request
    if (code != Code::done) return finish(code);
    protocol::Identity id;
    id.firmware = info_.firmware;
    id.board = info_.board;
    id.serial = info_.serial;
    id.firmware_key = info_.key;
    id.pairing = lock_.state();
    id.tick_hz = tick_hz_;
    id.block_bytes = Store::kCapacity;
    for (const std::uint8_t byte : kEffects.bits)
      for (int bit = 0; bit < 8; ++bit) id.effects = static_cast<std::uint16_t>(id.effects + ((byte >> bit) & 1));
    id.channels = kChannels;
    id.most_channels = TelemetrySetup::kMost;
    id.most_lines = control::kMostLines;
    finish(Code::done, id);
  }
  void effects() { finish(Code::done, kEffects); }
  void status() {
    const Status s = application_.snapshot();
    protocol::Status out;
    out.tick = s.tick;
    out.mode = s.mode;
    out.has_parameters = s.has_parameters;
    out.store = store_.state();
    out.fault = static_cast<std::uint8_t>(s.fault.fault);
    out.fault_tick = s.fault.tick;
    out.fault_seen = s.fault.seen;
    out.fault_limit = s.fault.limit;
    out.dropped = application_.telemetry().dropped();
    out.sequence = store_.sequence();
    out.staged = static_cast<std::uint32_t>(store_.staged());
    out.active = {static_cast<std::uint32_t>(store_.active().size()), store_.active_crc()};
    out.previous = {static_cast<std::uint32_t>(store_.previous().size()), store_.previous_crc()};
    finish(Code::done, out);
  }

  void reference() {
    const Status s = application_.snapshot();
    finish(Code::done, protocol::Reference{s.knows_turn, s.knows_output, application_.zero()});
  }

  // Blocks.

  void begin_block(const protocol::Message& m) {
    protocol::BlockBegin begin;
    if (!taken(m, begin)) return;
    if (armed()) return finish(Code::armed);
    if (!application_.at_rest()) return finish(Code::moving);
    finish(code_of(store_.begin(begin.bytes, begin.crc)));
  }
  // Factory reset: the parameters in use stay until the next start.
  void erase_all_blocks() {
    if (armed()) return finish(Code::armed);
    if (!application_.at_rest()) return finish(Code::moving);
    finish(code_of(store_.erase_all()));
  }
  void take_chunk(const protocol::Message& m) {
    protocol::Chunk chunk;
    if (!taken(m, chunk)) return;
    if (armed()) return finish(Code::armed);
    finish(code_of(store_.write(chunk.offset, std::span<const std::uint8_t>(chunk.bytes).first(chunk.count))));
  }
  void commit() {
    if (armed()) return finish(Code::armed);
    std::uint32_t reason = 0;
    const storage::StoreError error = store_.commit(validator(), reason);
    use_block(error, reason);
  }
  void restore(const protocol::Message& m) {
    protocol::BlockRestore request;
    if (!taken(m, request)) return;
    if (armed()) return finish(Code::armed);
    if (store_.sequence() == Store::sequence_after(request.sequence)) return finish(Code::done, protocol::Reason{});
    if (store_.sequence() != request.sequence) return finish(Code::wrong_value);
    std::uint32_t reason = 0;
    const storage::StoreError error = store_.restore(validator(), reason);
    use_block(error, reason);
  }
  void use_block(storage::StoreError error, std::uint32_t reason) {
    if (error != storage::StoreError::none) return finish(code_of(error), protocol::Reason{reason});
    blocks_.adopt(store_.active());
    waits_for_ = Wait::adoption;
  }
  void read_block(const protocol::Message& m) {
    protocol::BlockRead request;
    if (!taken(m, request)) return;
    const auto block = request.which == protocol::Which::active ? store_.active() : store_.previous();
    if (block.empty()) return finish(Code::no_block);
    if (request.offset > block.size()) return finish(Code::wrong_value);
    protocol::Chunk chunk;
    chunk.offset = request.offset;
    const std::size_t left = block.size() - request.offset;
    chunk.count = static_cast<std::uint8_t>(left < protocol::kMostChunk ? left : protocol::kMostChunk);
    for (std::size_t i = 0; i < chunk.count; ++i) chunk.bytes[i] = block[request.offset + i];
    finish(Code::done, chunk);
  }

  // Commands.

  static constexpr std::int64_t kFarthest = std::int64_t{1} << 62;
  void home(const protocol::Message& m) {
    protocol::Home request;
    if (!taken(m, request)) return;
    // The range in which an encoder's turns are counted.
    constexpr std::int64_t kMost = std::int64_t{1} << 56;
    if (request.position <= -kMost || request.position >= kMost) return finish(Code::wrong_value);
    command_ = {};
    command_.kind = Command::Kind::home;
    command_.position = {request.position};
    command_.number = ++command_number_;
    submit();
  }
  void command(const protocol::Message& m) {
    protocol::Command c;
    if (!taken(m, c)) return;
    for (const std::int32_t word : {c.velocity, c.acceleration, c.current})
      if (word == INT32_MIN) return finish(Code::wrong_value);
    if (c.position <= -kFarthest || c.position >= kFarthest) return finish(Code::wrong_value);
    command_ = {.kind = c.kind,
                .mode = c.mode,
                .compensate = c.compensate,
                .stream = c.stream,
                .number = ++command_number_,
                .position = N::Angle{c.position},
                .velocity = N::Value{{c.velocity}},
                .acceleration = N::Value{{c.acceleration}},
                .current = N::Value{{c.current}}};
    submit();
  }
  void submit() {
    application_.answer();  // to a command whose host is gone
    waits_for_ = application_.submit(command_) ? Wait::command : Wait::room;
  }

  void commissioning(const protocol::Message& m) {
    Command::Kind kind{};
    const Code code = CommissioningMessages::serve(application_.commissioning(), m, request_, kind);
    if (code != Code::done || kind == Command::Kind::heartbeat) return finish(code);
    command_ = {};
    command_.kind = kind;
    command_.number = ++command_number_;
    submit();
  }

  // The residual map.

  void map_info() {
    protocol::MapInfo info;
    const Code code = MapMessages::info(application_, info);
    return code == Code::done ? finish(code, info) : finish(code);
  }
  void map_bins(const protocol::Message& m) {
    protocol::MapFirst request;
    if (!taken(m, request)) return;
    protocol::MapBins bins;
    const Code code = MapMessages::bins(application_, request.first, bins);
    return code == Code::done ? finish(code, bins) : finish(code);
  }
  void map_command(const protocol::Message& m) {
    protocol::MapCommand request;
    if (!taken(m, request)) return;
    command_ = {};
    command_.kind = MapMessages::command_of(request.action);
    command_.number = ++command_number_;
    submit();
  }

  // Telemetry.

  void telemetry(const protocol::Message& m) {
    protocol::Subscription request;
    if (!taken(m, request)) return;
    TelemetrySetup setup;
    setup.every = request.every;
    setup.count = request.count;
    for (std::size_t i = 0; i < request.count; ++i) setup.channels[i] = request.channels[i];
    frames_.restart();
    finish(application_.telemetry().configure(setup) ? Code::done : Code::wrong_value);
  }

  static constexpr protocol::Effects kEffects = [] {
    protocol::Effects out;
    using Model = decltype(Parameters::model);
    const auto mark = []<class Effect>(protocol::Effects& all) {
      constexpr std::size_t number = Model::template number_of<Effect>();
      static_assert(number < 256);
      all.bits[number / 8] = static_cast<std::uint8_t>(all.bits[number / 8] | (1U << (number % 8)));
    };
    Model{}.for_each([&]<class Effect>(auto&) { mark.template operator()<Effect>(out); });
    return out;
  }();

  Application& application_;
  Store& store_;
  Blocks& blocks_;
  Lock& lock_;
  std::uint32_t tick_hz_;
  DriveInfo info_;
  protocol::Message answer_{};
  protocol::Message request_{};  // the request being answered
  TelemetryMessages frames_{};
  ExcitationIntake excitation_{};
  Command command_{};
  std::uint16_t command_number_ = 0;
  Wait waits_for_ = Wait::none;
  bool has_answer_ = false;
  bool agreed_ = false;
};

}  // namespace flexspline::firmware
