#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "firmware/application.hpp"
#include "hil/board/drive_rig.hpp"
#include "hil/board/software_board.hpp"

namespace flexspline::board {

/// A parameter block as it lies in a drive's flash, at a multiple of eight.
class Block {
 public:
  Block() = default;
  explicit Block(const firmware::Parameters& parameters);
  std::span<std::byte> bytes() { return {reinterpret_cast<std::byte*>(words_.data()), size_}; }
  std::span<const std::byte> bytes() const { return {reinterpret_cast<const std::byte*>(words_.data()), size_}; }
  bool empty() const { return size_ == 0; }

 private:
  std::vector<std::uint64_t> words_;
  std::size_t size_ = 0;
};

/// One frame of telemetry, as firmware/telemetry.hpp has it.
struct Frame {
  std::uint32_t sequence = 0;
  std::uint32_t tick = 0;
  std::vector<std::uint32_t> values;
};

/// A hash of frames (FNV-1a of their words): the same bits, the same number.
class FrameHash {
 public:
  void add(std::uint32_t word);
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325U;
};

/// The application on the software board with a drive around it: the whole of a drive on the desktop. Each tick runs
/// sense, control tick, act, then background work, in this order; nothing depends on the machine's clock.
class VirtualDrive {
 public:
  using Application = firmware::Application<SoftwareBoard>;

  /// `block` is what the drive finds in its flash at each reset; empty: none.
  explicit VirtualDrive(const RigSetup& setup, Block block = {});

  void run(std::uint32_t ticks);
  void run_seconds(double seconds);
  /// Submits a command, runs the tick that takes it and returns its answer.
  firmware::Answer command(const firmware::Command& command);
  /// Offers a block and runs until the drive has decided on it.
  firmware::BlockFinding commit(const Block& block);
  bool record(const firmware::TelemetrySetup& setup) { return application_->telemetry().configure(setup); }
  /// Frames are hashed as they come; with `keep` they are also kept in frames().
  void keep_frames(bool keep) { keep_ = keep; }
  /// With `collect` off nobody reads the telemetry, as when the host is too slow.
  void collect_frames(bool collect) { collect_ = collect; }

  DriveRig& rig() { return rig_; }
  Application& application() { return *application_; }
  SoftwareBoard& board() { return board_; }
  const firmware::Status& status() const { return application_->status(); }
  const std::vector<Frame>& frames() const { return frames_; }
  std::uint64_t telemetry_hash() const { return hash_.value(); }
  std::uint64_t frame_count() const { return frame_count_; }
  /// Of the watchdog, since the start.
  int resets() const { return resets_; }

 private:
  void reset(firmware::ResetCause cause);
  void collect();

  DriveRig rig_;
  Block flash_;
  Block offered_;
  SoftwareBoard board_;
  std::unique_ptr<Application> application_;
  std::vector<Frame> frames_;
  FrameHash hash_;
  std::uint64_t frame_count_ = 0;
  bool keep_ = false;
  bool collect_ = true;
  int resets_ = 0;
};

}  // namespace flexspline::board
