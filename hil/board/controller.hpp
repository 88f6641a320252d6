#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "firmware/application.hpp"
#include "firmware/co_simulation.hpp"
#include "shared/control/excitation_setup.hpp"

namespace flexspline::board {

/// A parameter block as in a drive's flash, aligned to eight bytes.
class Block {
 public:
  Block() = default;
  /// The bytes of a packed block, unchecked.
  explicit Block(std::span<const std::uint8_t> packed);
  /// Packs parameters that were derived with the constants `d`.
  Block(const firmware::Parameters& parameters, const effects::DriveConstants<double>& d);
  std::span<std::byte> bytes() { return {reinterpret_cast<std::byte*>(words_.data()), size_}; }
  std::span<const std::byte> bytes() const { return {reinterpret_cast<const std::byte*>(words_.data()), size_}; }
  /// Truncates it, like an interrupted transfer.
  void cut(std::size_t size) { size_ = size < size_ ? size : size_; }
  bool empty() const { return size_ == 0; }

 private:
  std::vector<std::uint64_t> words_;
  std::size_t size_ = 0;
};

/// Runs the application of a virtual drive, a tick at a time.
class Controller {
 public:
  virtual ~Controller() = default;
  /// Switches it on, or resets it: with `block` in its flash (empty: none) and this telemetry.
  virtual void start(const Block& block, const firmware::TelemetrySetup& telemetry, firmware::ResetCause cause) = 0;
  /// One tick, and the background work until the next one.
  virtual firmware::CoSimulationOutput tick(const firmware::CoSimulationInput& input) = 0;
  /// Offers another block, whose bytes must stay valid. Throws std::logic_error where the controller cannot take one
  /// while it runs.
  virtual void offer(std::span<const std::byte> block) = 0;
};

/// The board of the desktop: its readings are set through a pointer, its actuation is read by the caller.
class SoftwareBoard {
 public:
  static constexpr std::uint32_t kTickHz = 20'000;  ///< unless `tick_hz` is set to another rate
  static constexpr std::uint32_t kTelemetryWords = 2048;

  firmware::Readings read() const { return *readings; }
  void actuate(const firmware::Actuation& command) { actuation = command; }
  bool tick_overrun() const { return overrun; }
  void feed_watchdog() { ticks_since_fed = 0; }
  firmware::ResetCause reset_cause() const { return cause; }

  control::Hardware hardware() const { return hardware_stated; }

  std::uint32_t tick_hz = kTickHz;
  control::Hardware hardware_stated{};
  static constexpr firmware::Readings kNone{};
  const firmware::Readings* readings =
      &kNone;  ///< not a copy: copying a struct whose members were just written is slow
  firmware::Actuation actuation{};
  bool overrun = false;
  bool amplifier_tripped() const { return tripped || (stage != nullptr && stage->tripped()); }
  firmware::StageFault amplifier_fault() const {
    return stage != nullptr ? stage->fault() : firmware::StageFault::none;
  }

  /// The same in each run, from `random` on.
  firmware::RandomWords random_words() {
    control::SplitMix generator(random);
    firmware::RandomWords words{};
    for (std::uint32_t& word : words) word = static_cast<std::uint32_t>(generator.next());
    random = generator.state();
    return words;
  }

  /// nullptr: its amplifier takes a current.
  firmware::ThreePhaseStage* three_phase() const { return stage; }

  bool tripped = false;
  firmware::ThreePhaseStage* stage = nullptr;
  std::uint64_t random = 0;
  std::uint32_t ticks_since_fed = 0;
  firmware::ResetCause cause = firmware::ResetCause::power;
};

/// The application in this process, on the software board.
class SoftwareController : public Controller {
 public:
  explicit SoftwareController(std::uint32_t tick_hz = SoftwareBoard::kTickHz) { board_.tick_hz = tick_hz; }
  void start(const Block& block, const firmware::TelemetrySetup& telemetry, firmware::ResetCause cause) override;
  firmware::CoSimulationOutput tick(const firmware::CoSimulationInput& input) override;
  void offer(std::span<const std::byte> block) override { application_->offer(block); }
  /// The hardware that its board states from the next start on; before that nothing.
  void state(const control::Hardware& hardware) { hardware_ = hardware; }
  /// A bin of the residual map, as a message requests it.
  bool map_bin(std::uint16_t number, firmware::MapBin& bin) const { return application_->map_bin(number, bin); }

  /// The three-phase stage of its amplifier, from the next start on.
  void connect(firmware::ThreePhaseStage& stage) { stage_ = &stage; }

  /// The control tick, or background work, hangs.
  void hang_tick(bool hangs) { tick_hangs_ = hangs; }
  void hang_background(bool hangs) { background_hangs_ = hangs; }
  /// The amplifier switched itself off.
  void trip_amplifier(bool trips) { board_.tripped = trips; }
  /// Resets by the watchdog since the first start.
  int resets() const { return resets_; }

 private:
  Block flash_;
  control::Hardware hardware_{};
  firmware::ThreePhaseStage* stage_ = nullptr;
  firmware::TelemetrySetup telemetry_;
  SoftwareBoard board_;
  std::unique_ptr<firmware::Application<SoftwareBoard>> application_;
  bool tick_hangs_ = false;
  bool background_hangs_ = false;
  int resets_ = 0;
};

}  // namespace flexspline::board
