// Commissioning as a state of the drive: when it may begin, and what ends it. The motor is measured by the three-phase
// stage in its own interrupt (three_phase.hpp); the tick watches it, background work asks for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "firmware/board.hpp"
#include "firmware/messages.hpp"
#include "firmware/parameter_block.hpp"
#include "firmware/sequence_lock.hpp"
#include "firmware/three_phase.hpp"
#include "shared/protocol/commissioning_payloads.hpp"

namespace flexspline::firmware {

// Of a board without a three-phase stage: no code and no memory.
struct NoCommissioning {
  static constexpr bool kHasStage = false;
  static constexpr control::MotorCheck kMotorCheck = control::kHasNoStage;
  template <Board B>
  void begin(B&) {}
  void use_block(std::span<const std::byte>) {}
  void watch(Status&) {}
  std::optional<Refusal> obey(const Command&, Status&, bool) const { return {}; }
  bool may_arm() const { return true; }
  void note_host() {}
  void lose_host() {}
};

template <class Stage>
class CommissioningControl {
 public:
  static constexpr bool kHasStage = true;
  static constexpr control::MotorCheck kMotorCheck = control::kChecksMotor;
  using State = protocol::CommissioningState;

  template <Board B>
  void begin(B& board) {
    stage_ = board.three_phase();
    most_age_ = tick_hz_of(board) / 1000 * kHostMs;
  }

  // The tick's side.

  // Once a tick, after the checks of its safety.
  void watch(Status& status) {
    if (state() != State::runs) return;
    const control::commissioning::Commissioning& c = stage_->commissioning();
    if (!c.done()) step_ = c.step();
    age_ = heard_.load(std::memory_order_relaxed) ? 0 : age_ + 1;
    heard_.store(false, std::memory_order_relaxed);
    const State next = status.mode != Mode::commissioning ? State::drive_fault : state_now(c);
    if (next == State::runs) return;
    end(next);
    if (status.mode != Mode::commissioning) return;
    status.mode = Mode::idle;
    if (next != State::drive_fault) return;
    status.mode = Mode::fault;
    status.fault = {Fault::amplifier_fault, status.tick, 0, static_cast<std::int32_t>(stage_->commissioning_fault())};
  }
  // While the motor is measured every command is for that; otherwise only that which begins it. None: another one.
  [[gnu::noinline]] std::optional<Refusal> obey(const Command& command, Status& status, bool at_rest) {
    using Kind = Command::Kind;
    const bool stops = command.kind == Kind::stop_commissioning;
    if (status.mode == Mode::commissioning) {
      if (command.kind == Kind::heartbeat) return Refusal::none;
      if (!stops && command.kind != Kind::disarm) return Refusal::commissioning;
      end(State::stopped);
      status.mode = Mode::idle;
      return Refusal::none;
    }
    if (stops) return Refusal::none;
    if (command.kind != Kind::commission) return {};
    if (stage_ == nullptr || !stage_->is_sampled()) return Refusal::no_stage;
    if (status.mode == Mode::boot) return Refusal::booting;
    if (status.mode == Mode::fault) return Refusal::fault;
    if (status.mode != Mode::idle) return Refusal::armed;
    if (!at_rest) return Refusal::moving;
    stage_->commission(request_);
    age_ = 0;
    is_host_lost_.store(false, std::memory_order_relaxed);
    status.mode = Mode::commissioning;
    store_in_tick(state_, State::runs);
    return Refusal::none;
  }
  bool may_arm() const { return stage_ == nullptr || stage_->is_commissioned(); }

  // Of background work.

  // A block that was found valid is the drive's from now on; the drive is not armed.
  void use_block(std::span<const std::byte> block) {
    if (stage_ != nullptr) stage_->use(control::motor_of(detail::octets(block)));
  }
  bool exists() const { return stage_ != nullptr; }
  const Stage& stage() const { return *stage_; }
  // For the command that begins it. False: a number is outside what the drive takes; the board's limits hold.
  bool prepare(const protocol::CommissioningBegin& r) {
    const ThreePhaseSettings& s = stage_->settings();
    control::commissioning::Settings c;
    c.sensors.gain = {kWhole, kWhole, kWhole};
    c.sensors.two = s.foc.sensors.two;
    c.modulation = s.test_modulation;
    c.offsets = s.offsets;
    c.timer_counts = s.timer_counts;
    c.least_bus = r.least_bus;
    c.current = r.current;
    c.most_current = r.most_current;
    c.most_voltage = r.most_voltage;
    c.voltage_ramp = r.voltage_ramp;
    c.slow_step = r.slow_step;
    c.fast_step = r.fast_step;
    c.most_shaft_step = r.most_shaft_step;
    c.step_ramp = r.step_ramp;
    c.most_travel = r.most_travel;
    c.most_periods = r.most_periods;
    c.stated_pole_pairs = r.stated_pole_pairs;
    const bool good = valid(c) && c.most_current <= s.most_phase && c.least_bus >= s.least_bus;
    if (good && state() != State::runs) request_ = c;
    return good;
  }
  // A request arrived; or the link was lost.
  void note_host() { heard_.store(true, std::memory_order_relaxed); }
  void lose_host() { is_host_lost_.store(true, std::memory_order_relaxed); }

  State state() const { return state_.load(std::memory_order_acquire); }
  // Valid in every state but `none`.
  control::commissioning::Step step() const { return step_; }
  const control::commissioning::Settings& request() const { return request_; }

 private:
  static constexpr std::uint32_t kHostMs = 500;  // without a request of the host
  static constexpr std::int32_t kWhole = 4096;   // SensorSettings::gain of an exact sensor

  State state_now(const control::commissioning::Commissioning& c) const {
    const StageFault fault = stage_->commissioning_fault();
    if (fault != StageFault::none) return fault == StageFault::bus_high ? State::bus_high : State::drive_fault;
    if (c.done()) return c.result().fault == control::commissioning::Fault::none ? State::done : State::fault;
    const bool lost = is_host_lost_.load(std::memory_order_relaxed) || age_ >= most_age_;
    return lost ? State::host_lost : State::runs;
  }
  void end(State state) {
    stage_->stop_commissioning();
    store_in_tick(state_, state);
  }

  Stage* stage_ = nullptr;
  control::commissioning::Settings request_;
  std::atomic<State> state_{State::none};
  std::atomic<bool> heard_{false};
  std::atomic<bool> is_host_lost_{false};
  control::commissioning::Step step_ = control::commissioning::Step::bus;
  std::uint32_t age_ = 0;  // ticks since the host's last request
  std::uint32_t most_age_ = 0;
};

template <Board B>
struct CommissioningChoice {
  using Type = NoCommissioning;
};
template <Board B>
requires requires(B& board) {
  board.three_phase();
}
struct CommissioningChoice<B> {
  using Type = CommissioningControl<std::remove_pointer_t<decltype(std::declval<B&>().three_phase())>>;
};
template <Board B>
using CommissioningOf = typename CommissioningChoice<B>::Type;

}  // namespace flexspline::firmware
