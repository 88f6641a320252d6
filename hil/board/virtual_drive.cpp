#include "hil/board/virtual_drive.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace flexspline::board {

void FrameHash::add(std::uint64_t words) {
  hash_ ^= words;
  hash_ *= 0x100000001b3U;
  // Without the shift the upper bits of a word would never reach the lower ones.
  hash_ ^= hash_ >> 29U;
}

namespace {
// Its application knows why the three-phase stage switched itself off.
std::unique_ptr<Controller> own_controller(PlantRig& rig) {
  auto controller = std::make_unique<SoftwareController>(rig.tick_hz());
  if (rig.three_phase() != nullptr) controller->connect(rig.three_phase()->stage());
  return controller;
}
}  // namespace

VirtualDrive::VirtualDrive(const RigSetup& setup, const Block& block, const firmware::TelemetrySetup& telemetry,
                           std::unique_ptr<Controller> controller)
    : rig_(setup),
      controller_(controller ? std::move(controller) : own_controller(rig_)),
      flash_(block),
      telemetry_(telemetry) {
  controller_->start(flash_, telemetry_, firmware::ResetCause::power);
}

void VirtualDrive::power(bool on) {
  if (on == powered_) return;
  powered_ = on;
  posted_.reset();
  output_ = {};
  if (on) controller_->start(flash_, telemetry_, firmware::ResetCause::power);
}

void VirtualDrive::run(std::uint32_t ticks) {
  for (std::uint32_t k = 0; k < ticks; ++k) {
    if (!powered_) {
      posted_.reset();
      rig_.act({});
      continue;
    }
    rig_.sense(input_.readings);
    input_.overrun = rig_.has(Injection::tick_overrun);
    input_.reads_frame = reads_;
    input_.has_command = posted_.has_value();
    if (posted_) {
      input_.command = *posted_;
      posted_.reset();
    }
    output_ = controller_->tick(input_);
    rig_.act(output_.actuation);
    take_frame();
  }
}

void VirtualDrive::run_seconds(double seconds) {
  run(static_cast<std::uint32_t>(std::llround(seconds * rig_.tick_hz())));
}

firmware::Answer VirtualDrive::command(const firmware::Command& command) {
  post(command);
  run(1);
  if (!output_.has_answer) throw std::runtime_error("the drive gave no answer within a tick; does its tick run?");
  return output_.answer;
}

firmware::BlockFinding VirtualDrive::commit(const Block& block) {
  constexpr int kMostTicks = 10;
  offered_ = block;
  controller_->offer(offered_.bytes());
  for (int k = 0; k < kMostTicks; ++k) {
    run(1);
    if (output_.has_finding) return output_.finding;
  }
  throw std::runtime_error("the drive did not accept or refuse a block; does its background work run?");
}

void VirtualDrive::take_frame() {
  if (output_.frame_words == 0) return;
  std::size_t i = 0;
  for (; i + 1 < output_.frame_words; i += 2) hash_.add(output_.frame[i] | std::uint64_t{output_.frame[i + 1]} << 32U);
  if (i < output_.frame_words) hash_.add(output_.frame[i]);
  ++frame_count_;
  if (keep_)
    frames_.push_back(
        {output_.frame[0], output_.frame[1], {output_.frame.begin() + 2, output_.frame.begin() + output_.frame_words}});
}

}  // namespace flexspline::board
