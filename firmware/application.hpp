// The application of a drive, for any board: modes, the control tick, and background work.
//
//   the timer's interrupt -> Drive::tick() of the board -> Application::tick() -> Control::observe(), Control::update()
//
// The tick interrupts background work, never the other way round. The state of the drive belongs to the tick; a command
// waits in a mailbox for the next tick. Parameters are written by background work: as a whole after the tick released
// them, which it does only while the amplifier is off; the excitation alone while the drive is not armed.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/angle_reference.hpp"
#include "firmware/board.hpp"
#include "firmware/commissioning_control.hpp"
#include "firmware/control.hpp"
#include "firmware/faults.hpp"
#include "firmware/messages.hpp"
#include "firmware/parameter_block.hpp"
#include "firmware/safety.hpp"
#include "firmware/sequence_lock.hpp"
#include "firmware/signals.hpp"
#include "firmware/telemetry.hpp"
#include "firmware/watchdog.hpp"

namespace flexspline::firmware {

template <Board B>
class Application {
 public:
  using Ring = Telemetry<B::kTelemetryWords, Signals::Places>;
  static constexpr std::uint32_t kBootTicks = 50;
  static constexpr std::uint32_t kRestTicks = 100;  // within two counts

  // In an image the application is constinit; begin() starts it from main().
  constexpr Application() = default;
  explicit Application(B& board) { begin(board); }
  Application(const Application&) = delete;
  void begin(B& board) {
    board_ = &board;
    const control::Hardware hardware = hardware_of(board);
    most_command_ = control::most_command(hardware);
    most_reading_ = control::most_reading(hardware);
    reference_.begin(hardware);
    commissioning_.begin(board);
  }

  // The control tick: called by the board's timer, kTickHz times a second. All in one function: calls between its parts
  // would take a sixth of its time.
  [[gnu::flatten]] void tick() {
    const Readings& readings = board_->read();
    status_lock_.begin_write();
    ++status_.tick;
    watch_rest(readings.motor_counter);
    release_or_take_parameters();
    const std::uint32_t due = control_.due_at(status_.tick);
    Estimate& estimate = signals_.estimate;
    // Still of the previous tick.
    Output& output = signals_.output;
    if (!is_armed(status_.mode)) output = {};
    if (has_parameters()) {
      control_.observe(readings, due, estimate);
    } else {
      estimate = {};
    }
    if (has_parameters() && !is_armed(status_.mode)) reference_.update(control_, status_, readings, estimate);
    if ((due & kResidualMap) != 0 && status_.maps_residual && control_.has_residual())
      residual_map_.add(parameters().residual_map, estimate.velocity, estimate.angle, control_.residual());
    take_command(estimate);
    check_safety(readings, estimate, due);
    commissioning_.watch(status_);
    if (is_armed(status_.mode)) {
      control_.update(demand_, estimate, due, output);
    } else {
      output = {};
    }
    board_->actuate(actuation(output));
    watchdog_.report(Part::tick);
    update_mode(output);
    record(readings);
    if (board_->tick_overrun()) [[unlikely]]
      note_overrun();
    status_lock_.end_write();
  }

  // Background work: called repeatedly from main(), and interrupted by the tick at any point.
  void background() {
    watchdog_.report(Part::background);
    take_block();
    if (watchdog_.all_reported()) board_->feed_watchdog();
  }

  // The command interface, for background work (a protocol) or for the caller of the tick, but not for both at once.
  // False: the previous command has not been taken yet; the next tick takes it.
  bool submit(const Command& command) {
    if (command_waits_.load(std::memory_order_acquire)) return false;
    command_ = command;
    command_waits_.store(true, std::memory_order_release);
    return true;
  }
  // The answer to the last command taken, once.
  std::optional<Answer> answer() {
    if (!answer_waits_.load(std::memory_order_acquire)) return {};
    const Answer answer = answer_;
    answer_waits_.store(false, std::memory_order_release);
    return answer;
  }
  // Whether this drive can take a block. It is checked in place.
  BlockFinding check(std::span<const std::byte> block) const {
    return check_block(block, tick_hz_of(*board_), hardware(), CommissioningOf<B>::kMotorCheck);
  }
  control::Hardware hardware() const { return hardware_of(*board_); }
  // Before the first tick: takes the block in flash at once. If it is not valid the drive has no parameters.
  void boot_with(std::span<const std::byte> block) {
    const BlockFinding finding = check(block);
    if (finding == BlockFinding::none) {
      load_block(block, parameters());
      commissioning_.use_block(block);
      new_parameters_ = true;
    }
    block_done(finding);
  }
  // A packed parameter block, in flash or in memory. It has to stay in place until block_finding() has the answer,
  // which background work determines.
  void offer(std::span<const std::byte> block) {
    block_ = block;
    block_finding_.reset();
    block_step_ = BlockStep::check;
  }
  std::optional<BlockFinding> block_finding() const { return block_finding_; }

  // Changes the excitation: edit(coefficients, is torque). The tick reads it in mode `excitation` only, which it enters
  // only by a command from background work; so the tick need not release the parameters. Returns false and does nothing
  // while the drive is armed or its motor is measured, a command waits, or there are no parameters.
  template <class Edit>
  bool edit_excitation(Edit&& edit) {
    if (is_live(status_.mode) || command_waits_.load(std::memory_order_acquire) || !has_parameters()) return false;
    edit(parameters().excitation, parameters().excites_torque);
    return true;
  }
  // A bin of the residual map, for background work. False: there is no bin of this number.
  bool map_bin(std::uint16_t number, MapBin& bin) const { return read_bin(residual_map_, number, bin); }
  // The meaning of the bins, from the parameters, which only background work changes. nullptr without parameters.
  const control::ResidualMap::Coefficients* map_coefficients() const {
    return has_parameters() ? &parameters().residual_map : nullptr;
  }
  std::uint32_t map_version() const { return residual_map_.version(); }

  // The motor's count has not changed for a while: flash memory may be written, which may stop the processor, without
  // losing count of turns.
  bool at_rest() const { return rest_ticks_ >= kRestTicks; }

  Ring& telemetry() { return telemetry_; }
  // For the caller of the tick; other contexts may read single fields only.
  const Status& status() const { return status_; }
  // The same for background work, which the tick interrupts: a consistent copy.
  Status snapshot() const { return status_lock_.read(status_); }
  // What the encoders show at the zeros that `home` set, for a host that stores it.
  control::StoredZero zero() const { return status_lock_.read(reference_.zero()); }
  CommissioningOf<B>& commissioning() { return commissioning_; }

 private:
  enum class BlockStep : std::uint8_t { none, check, wait };
  enum class Owner : std::uint8_t { tick, requested, background };

  bool has_parameters() const { return status_.has_parameters; }
  Parameters& parameters() { return control_.parameters(); }
  const Parameters& parameters() const { return control_.parameters(); }
  void watch_rest(std::uint32_t counter) {
    const auto strayed = static_cast<std::int32_t>(counter - rest_counter_);
    if (strayed > kRestCounts || strayed < -kRestCounts) {
      rest_counter_ = counter;
      rest_ticks_ = 0;
    } else if (rest_ticks_ < kRestTicks) {
      ++rest_ticks_;
    }
  }

  // Parameters.

  // The tick's part: releases the parameters while no mode uses them, and restarts with the new ones.
  void release_or_take_parameters() {
    const Owner owner = load_in_tick(owner_);
    if (owner == Owner::requested && !is_live(status_.mode)) {
      status_.has_parameters = false;
      status_.maps_residual = false;  // in other bases the bins have another meaning
      owner_.store(Owner::background, std::memory_order_release);
    } else if (owner == Owner::tick && new_parameters_) {
      new_parameters_ = false;
      status_.has_parameters = true;
      if (control_.restart()) reference_.forget(control_, status_);
      safety_ = {};
    }
  }
  // Background work's part: the parameters are written only after the whole block was checked.
  void take_block() {
    if (block_step_ == BlockStep::check) {
      const BlockFinding finding = check(block_);
      if (finding != BlockFinding::none) return block_done(finding);
      owner_.store(Owner::requested, std::memory_order_release);
      requested_at_ = status_.tick;
      block_step_ = BlockStep::wait;
    } else if (block_step_ == BlockStep::wait) {
      if (owner_.load(std::memory_order_acquire) == Owner::background) {
        load_block(block_, parameters());
        commissioning_.use_block(block_);
        new_parameters_ = true;
        owner_.store(Owner::tick, std::memory_order_release);
        block_done(BlockFinding::none);
      } else if (status_.tick - requested_at_ > 1) {
        Owner expected = Owner::requested;
        if (owner_.compare_exchange_strong(expected, Owner::tick)) block_done(BlockFinding::armed);
      }
    }
  }
  void block_done(BlockFinding finding) {
    block_step_ = BlockStep::none;
    block_finding_ = finding;
  }

  // Commands.

  void take_command(const Estimate& estimate) {
    if (!load_in_tick(command_waits_)) return;
    safety_.note_host();
    const Refusal refusal = obey(command_, estimate);
    answer_ = {command_.number, refusal, status_.mode};
    answer_waits_.store(true, std::memory_order_release);
    command_waits_.store(false, std::memory_order_release);
  }
  // Rare commands are not inlined into the tick.
  [[gnu::noinline]] Refusal obey(const Command& command, const Estimate& estimate) {
    if (const auto done = commissioning_.obey(command, status_, at_rest())) return *done;
    switch (command.kind) {
      case Command::Kind::heartbeat:
        return Refusal::none;
      case Command::Kind::arm:
        return arm(command, estimate);
      case Command::Kind::set:
        if (!may_be_commanded(status_.mode)) return Refusal::not_armed;
        if (command.mode != status_.mode) return Refusal::other_mode;
        take_set_point(command);
        control_.take(demand_);
        return Refusal::none;
      case Command::Kind::disarm:
        if (!is_armed(status_.mode)) return Refusal::not_armed;
        // A drive that is stopping because of a fault stays in that fault.
        if (status_.mode == Mode::stop) {
          enter_fault(status_.fault);
        } else {
          enter_idle();
        }
        return Refusal::none;
      case Command::Kind::clear_fault:
        // Back to boot: idle again once the sensors were valid for as long as after a reset.
        if (status_.mode != Mode::fault) return Refusal::none;
        status_.mode = Mode::boot;
        boot_ticks_ = 0;
        return Refusal::none;
      case Command::Kind::start_map:
      case Command::Kind::stop_map:
        if (!has_parameters()) return Refusal::no_parameters;
        status_.maps_residual = command.kind == Command::Kind::start_map;
        return Refusal::none;
      case Command::Kind::home:
        return home(command, estimate);
      case Command::Kind::clear_map:
        if (is_armed(status_.mode)) return Refusal::armed;
        residual_map_.reset();
        return Refusal::none;
      case Command::Kind::commission:
      case Command::Kind::stop_commissioning:
        return Refusal::no_stage;
    }
    return Refusal::no_mode;
  }
  Refusal arm(const Command& command, const Estimate& estimate) {
    if (status_.mode == Mode::boot) return Refusal::booting;
    if (status_.mode == Mode::fault || status_.mode == Mode::stop) return Refusal::fault;
    if (!may_be_commanded(command.mode)) return Refusal::no_mode;
    if (!has_parameters()) return Refusal::no_parameters;
    if (!commissioning_.may_arm()) return Refusal::not_commissioned;
    if (command.mode == Mode::excitation && parameters().excitation.ticks == 0) return Refusal::no_excitation;
    if (status_.mode == Mode::idle && N::magnitude(estimate.velocity) > parameters().safety.standstill)
      return Refusal::moving;
    status_.mode = command.mode;
    demand_.compensate = command.compensate;
    take_set_point(command);
    control_.start(demand_, estimate);
    safety_.begin_mode();
    return Refusal::none;
  }
  Refusal home(const Command& command, const Estimate& estimate) {
    if (status_.mode == Mode::boot) return Refusal::booting;
    if (status_.mode == Mode::fault) return Refusal::fault;
    if (is_armed(status_.mode)) return Refusal::armed;
    if (!has_parameters()) return Refusal::no_parameters;
    if (!at_rest() || N::magnitude(estimate.velocity) > parameters().safety.standstill) return Refusal::moving;
    reference_.home(control_, status_, command.position);
    return Refusal::none;
  }
  void take_set_point(const Command& command) {
    safety_.note_set_point();
    demand_.mode = command.mode;
    demand_.stream = command.stream;
    demand_.position = command.position;
    demand_.velocity = command.velocity;
    demand_.acceleration = command.acceleration;
    demand_.current = command.current;
  }

  // Modes.

  void check_safety(const Readings& readings, const Estimate& estimate, std::uint32_t due) {
    FaultRecord found;
    found.fault = Fault::none;
    safety_.check_samples(found, readings, most_reading_, [this] {
      const bool needs_output = has_parameters() && parameters().has_output_encoder;
      return needs_output ? output_sample_ticks_of<B>() : std::uint32_t{0};
    });
    if (found.fault == Fault::none && has_parameters())
      safety_.check(found, readings, estimate, signals_.output, parameters(), status_.mode, due,
                    [this] { return control_.streams_in_motion(); });
    if (found.fault != Fault::none) [[unlikely]] {
      found.tick = status_.tick;
      boot_ticks_ = 0;
      respond(found, estimate);
    } else if (status_.mode == Mode::boot) {
      boot();
    }
    // Also in a stop whose cause lasts.
    if (is_armed(status_.mode) && amplifier_tripped_of(*board_)) {
      const auto before = static_cast<std::int32_t>(status_.mode == Mode::stop ? status_.fault.fault : Fault::none);
      enter_fault({Fault::amplifier_fault, status_.tick, before, amplifier_fault_of(*board_)});
    }
  }
  void boot() {
    if (++boot_ticks_ < kBootTicks) return;
    status_.mode = Mode::idle;
    const ResetCause cause = board_->reset_cause();
    if (cause != ResetCause::power && !reported_reset_)
      enter_fault({cause == ResetCause::watchdog ? Fault::watchdog : Fault::crashed, status_.tick, 0, 0});
    reported_reset_ = true;
  }
  // A drive that is off stays off; one that is stopping already is not stopped again.
  [[gnu::noinline]] void respond(const FaultRecord& found, const Estimate& estimate) {
    if (status_.mode == Mode::fault) return;
    if (!is_armed(status_.mode) || ends_in(found.fault) == SafeState::off) return enter_fault(found);
    if (status_.mode == Mode::stop) return;
    status_.fault = found;
    status_.mode = Mode::stop;
    demand_ = {.mode = Mode::stop};
    stop_ticks_ = 0;
    control_.start(demand_, estimate);
  }
  // In a fault already, or stopping because of one: the first cause is kept.
  [[gnu::noinline]] void note_overrun() {
    ++status_.overruns;
    if (status_.mode == Mode::fault) return;
    enter_fault(status_.mode == Mode::stop ? status_.fault : FaultRecord{Fault::tick_overrun, status_.tick, 0, 0});
  }
  [[gnu::noinline]] void enter_fault(const FaultRecord& found) {
    status_.fault = found;
    status_.mode = Mode::fault;
    amplifier_off();
    if (AngleReference::is_lost_by(found.fault)) reference_.lose(control_, status_);
  }
  void enter_idle() {
    status_.mode = Mode::idle;
    amplifier_off();
  }
  void amplifier_off() {
    demand_ = {};
    control_.off();
    board_->actuate({});
  }
  // The mode of the next tick, from this tick's output.
  void update_mode(const Output& output) {
    if (status_.mode == Mode::excitation && output.finished) enter_idle();
    if (status_.mode != Mode::stop) return;
    if (output.at_rest) return enter_fault(status_.fault);
    if (++stop_ticks_ >= parameters().safety.stop_ticks)
      enter_fault({Fault::stop_failed, status_.tick, static_cast<std::int32_t>(status_.fault.fault), 0});
  }

  Actuation actuation(const Output& output) const {
    if (!is_armed(status_.mode)) return {};
    const N::Value share = N::scaled(parameters().amplifier, output.current);
    const std::int32_t word = fixed::rounded_shift<fixed::kValueBits - 15>(share.raw);
    return {static_cast<std::int16_t>(fixed::limited_to(word, most_command_)), true};
  }

  void record(const Readings& readings) {
    signals_.state = static_cast<std::uint32_t>(status_.mode) | (static_cast<std::uint32_t>(status_.fault.fault) << 8) |
                     (signals_.output.limited ? 1U << 16 : 0U) | reference_.unknown_bits();
    signals_.motor_counter = readings.motor_counter;
    telemetry_.record(status_.tick, signals_);
  }

  B* board_ = nullptr;
  std::int32_t most_command_ = 0;  // as the board states it, a share of full scale; set by begin()
  std::int32_t most_reading_ = 0;
  SequenceLock status_lock_;
  Status status_{};
  Demand demand_{};
  Signals signals_{};
  Safety safety_{};
  Watchdog watchdog_{};
  Control control_{};
  AngleReference reference_{};
  std::uint32_t rest_counter_ = 0;
  std::uint32_t rest_ticks_ = 0;
  std::uint32_t boot_ticks_ = 0;
  std::uint32_t stop_ticks_ = 0;
  bool reported_reset_ = false;

  Command command_{};
  Answer answer_{};
  std::atomic<bool> command_waits_{false};
  std::atomic<bool> answer_waits_{false};

  std::span<const std::byte> block_{};
  std::optional<BlockFinding> block_finding_{};
  BlockStep block_step_ = BlockStep::none;
  std::uint32_t requested_at_ = 0;
  std::atomic<Owner> owner_{Owner::tick};
  bool new_parameters_ = false;
  [[no_unique_address]] CommissioningOf<B> commissioning_{};

  // Last, as a tick reaches the first members in fewer instructions.
  Ring telemetry_{};
  control::ResidualMap residual_map_{};
};

}  // namespace flexspline::firmware
