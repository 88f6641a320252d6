#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "hil/board/controller.hpp"
#include "hil/board/plant_rig.hpp"

namespace flexspline::board {

/// One frame of telemetry, as firmware/telemetry.hpp has it.
struct Frame {
  std::uint32_t sequence = 0;
  std::uint32_t tick = 0;
  std::vector<std::uint32_t> values;
};

/// A hash of frames (FNV-1a on two words at a time, with a shift): the same bits, the same number.
class FrameHash {
 public:
  void add(std::uint64_t words);
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325U;
};

/// A rig with the application: a whole drive on the desktop. Each tick runs sense, control tick, act, in this order,
/// independent of the machine's clock.
class VirtualDrive {
 public:
  /// `block` is what the drive finds in its flash at each reset; empty: none. Without a controller it gets a
  /// SoftwareController.
  VirtualDrive(const RigSetup& setup, const Block& block, const firmware::TelemetrySetup& telemetry = {},
               std::unique_ptr<Controller> controller = nullptr);

  void run(std::uint32_t ticks);
  void run_seconds(double seconds);
  /// Sends a command with the next tick, without waiting for the answer.
  void post(const firmware::Command& command) { posted_ = command; }
  /// Sends a command, runs the tick that takes it and returns its answer.
  firmware::Answer command(const firmware::Command& command);
  /// Offers a block and runs until the drive has decided on it.
  firmware::BlockFinding commit(const Block& block);

  /// Without power neither amplifier nor processor works; when it returns the drive starts from its flash memory.
  void power(bool on);

  /// All frames are hashed; with `keep_frames` they are in frames() as well.
  void keep_frames(bool keep) { keep_ = keep; }
  /// Without reading, the drive's ring of telemetry fills up.
  void read_frames(bool read) { reads_ = read; }

  PlantRig& rig() { return rig_; }
  const PlantRig& rig() const { return rig_; }
  Controller& controller() { return *controller_; }
  const firmware::Status& status() const { return output_.status; }
  const firmware::CoSimulationOutput& last() const { return output_; }
  const std::vector<Frame>& frames() const { return frames_; }
  std::uint64_t telemetry_hash() const { return hash_.value(); }
  std::uint64_t frame_count() const { return frame_count_; }

 private:
  void take_frame();

  PlantRig rig_;
  std::unique_ptr<Controller> controller_;
  Block flash_;
  firmware::TelemetrySetup telemetry_;
  Block offered_;
  firmware::CoSimulationInput input_{};
  firmware::CoSimulationOutput output_{};
  std::optional<firmware::Command> posted_;
  std::vector<Frame> frames_;
  FrameHash hash_;
  std::uint64_t frame_count_ = 0;
  bool keep_ = false;
  bool reads_ = true;
  bool powered_ = true;
};

}  // namespace flexspline::board
