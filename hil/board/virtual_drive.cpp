#include "hil/board/virtual_drive.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace flexspline::board {

void FrameHash::add(std::uint64_t words) {
  hash_ ^= words;
  hash_ *= 0x100000001b3U;
  // Of a whole word at a time the upper bits would reach the lower ones never.
  hash_ ^= hash_ >> 29U;
}

VirtualDrive::VirtualDrive(const RigSetup& setup, const Block& block, const firmware::TelemetrySetup& telemetry,
                           std::unique_ptr<Brain> brain)
    : rig_(setup),
      brain_(brain ? std::move(brain) : std::make_unique<SoftwareBrain>(setup.tick_hz)),
      flash_(block),
      telemetry_(telemetry) {
  brain_->start(flash_, telemetry_, firmware::ResetCause::power);
}

void VirtualDrive::power(bool on) {
  if (on == powered_) return;
  powered_ = on;
  posted_.reset();
  up_ = {};
  if (on) brain_->start(flash_, telemetry_, firmware::ResetCause::power);
}

void VirtualDrive::run(std::uint32_t ticks) {
  for (std::uint32_t k = 0; k < ticks; ++k) {
    if (!powered_) {
      posted_.reset();
      rig_.act({});
      continue;
    }
    rig_.sense(down_.readings);
    down_.overrun = rig_.has(Injection::tick_overrun);
    down_.reads_frame = reads_;
    down_.has_command = posted_.has_value();
    if (posted_) {
      down_.command = *posted_;
      posted_.reset();
    }
    up_ = brain_->tick(down_);
    rig_.act(up_.actuation);
    take_frame();
  }
}

void VirtualDrive::run_seconds(double seconds) {
  run(static_cast<std::uint32_t>(std::llround(seconds * rig_.tick_hz())));
}

firmware::Answer VirtualDrive::command(const firmware::Command& command) {
  post(command);
  run(1);
  if (!up_.has_answer) throw std::runtime_error("the drive gave no answer within a tick; does its tick run?");
  return up_.answer;
}

firmware::BlockFinding VirtualDrive::commit(const Block& block) {
  constexpr int kMostTicks = 10;
  offered_ = block;
  brain_->offer(offered_.bytes());
  for (int k = 0; k < kMostTicks; ++k) {
    run(1);
    if (up_.has_finding) return up_.finding;
  }
  throw std::runtime_error("the drive did not decide on a block; does its background work run?");
}

void VirtualDrive::take_frame() {
  if (up_.frame_words == 0) return;
  std::size_t i = 0;
  for (; i + 1 < up_.frame_words; i += 2) hash_.add(up_.frame[i] | std::uint64_t{up_.frame[i + 1]} << 32U);
  if (i < up_.frame_words) hash_.add(up_.frame[i]);
  ++frame_count_;
  if (keep_)
    frames_.push_back({up_.frame[0], up_.frame[1], {up_.frame.begin() + 2, up_.frame.begin() + up_.frame_words}});
}

}  // namespace flexspline::board
