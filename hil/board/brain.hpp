#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "firmware/application.hpp"
#include "firmware/lock_step.hpp"

namespace flexspline::board {

/// A parameter block as it lies in a drive's flash, at a multiple of eight.
class Block {
 public:
  Block() = default;
  /// The bytes of a packed block, whatever they are.
  explicit Block(std::span<const std::uint8_t> packed);
  /// Packs parameters that were derived with the constants `d`.
  Block(const firmware::Parameters& parameters, const effects::DriveConstants<double>& d);
  std::span<std::byte> bytes() { return {reinterpret_cast<std::byte*>(words_.data()), size_}; }
  std::span<const std::byte> bytes() const { return {reinterpret_cast<const std::byte*>(words_.data()), size_}; }
  /// Makes it shorter, as a transfer that was cut off does.
  void cut(std::size_t size) { size_ = size < size_ ? size : size_; }
  bool empty() const { return size_ == 0; }

 private:
  std::vector<std::uint64_t> words_;
  std::size_t size_ = 0;
};

/// Whatever runs the application of a virtual drive, a tick at a time.
class Brain {
 public:
  virtual ~Brain() = default;
  /// Switches it on, or resets it: with `block` in its flash (empty: none) and this telemetry.
  virtual void start(const Block& block, const firmware::TelemetrySetup& telemetry, firmware::ResetCause cause) = 0;
  /// One tick, and what background work has to do until the next.
  virtual firmware::LockStepUp tick(const firmware::LockStepDown& down) = 0;
  /// Offers another block, whose bytes stay. Throws std::logic_error where the brain cannot take one while it runs.
  virtual void offer(std::span<const std::byte> block) = 0;
};

/// The board of the desktop: it is told where samples are, the actuation is taken out.
class SoftwareBoard {
 public:
  static constexpr std::uint32_t kTickHz = 20'000;  ///< unless it is told otherwise
  static constexpr std::uint32_t kTelemetryWords = 2048;

  firmware::Readings read() const { return *readings; }
  void actuate(const firmware::Actuation& wanted) { actuation = wanted; }
  bool tick_overrun() const { return overrun; }
  void feed_watchdog() { ticks_since_fed = 0; }
  firmware::ResetCause reset_cause() const { return cause; }

  control::Hardware hardware() const { return hardware_stated; }

  std::uint32_t tick_hz = kTickHz;
  control::Hardware hardware_stated{};
  static constexpr firmware::Readings kNone{};
  const firmware::Readings* readings = &kNone;  ///< not a copy: what was just written in parts is slow to copy at once
  firmware::Actuation actuation{};
  bool overrun = false;
  bool amplifier_tripped() const { return tripped; }

  bool tripped = false;
  std::uint32_t ticks_since_fed = 0;
  firmware::ResetCause cause = firmware::ResetCause::power;
};

/// The application in this process, on the software board.
class SoftwareBrain : public Brain {
 public:
  explicit SoftwareBrain(std::uint32_t tick_hz = SoftwareBoard::kTickHz) { board_.tick_hz = tick_hz; }
  void start(const Block& block, const firmware::TelemetrySetup& telemetry, firmware::ResetCause cause) override;
  firmware::LockStepUp tick(const firmware::LockStepDown& down) override;
  void offer(std::span<const std::byte> block) override { application_->offer(block); }
  /// What its board states from the next start on; nothing before.
  void state(const control::Hardware& hardware) { hardware_ = hardware; }
  /// A bin of the residual map, as a message asks for it.
  bool map_bin(std::uint16_t number, firmware::MapBin& bin) const { return application_->map_bin(number, bin); }

  /// The control tick, or background work, does not run any more.
  void hang_tick(bool hangs) { tick_hangs_ = hangs; }
  void hang_background(bool hangs) { background_hangs_ = hangs; }
  /// The amplifier switched itself off.
  void trip_amplifier(bool trips) { board_.tripped = trips; }
  /// Of the watchdog, since the first start.
  int resets() const { return resets_; }

 private:
  Block flash_;
  control::Hardware hardware_{};
  firmware::TelemetrySetup telemetry_;
  SoftwareBoard board_;
  std::unique_ptr<firmware::Application<SoftwareBoard>> application_;
  bool tick_hangs_ = false;
  bool background_hangs_ = false;
  int resets_ = 0;
};

}  // namespace flexspline::board
