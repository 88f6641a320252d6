#include "hil/board/virtual_drive.hpp"

#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace flexspline::board {

Block::Block(const firmware::Parameters& parameters)
    : words_((firmware::kBlockBytes + 7) / 8), size_(firmware::kBlockBytes) {
  firmware::write_block(parameters, bytes());
}

void FrameHash::add(std::uint32_t word) {
  for (int byte = 0; byte < 4; ++byte) {
    hash_ ^= (word >> (8 * byte)) & 0xFFU;
    hash_ *= 0x100000001b3U;
  }
}

VirtualDrive::VirtualDrive(const RigSetup& setup, Block block) : rig_(setup), flash_(std::move(block)) {
  reset(firmware::ResetCause::power);
}

void VirtualDrive::reset(firmware::ResetCause cause) {
  board_ = {};
  board_.cause = cause;
  application_ = std::make_unique<Application>(board_);
  if (!flash_.empty()) application_->offer(flash_.bytes());
}

void VirtualDrive::run(std::uint32_t ticks) {
  for (std::uint32_t k = 0; k < ticks; ++k) {
    board_.readings = rig_.sense();
    board_.overrun = rig_.has(Injection::tick_overrun);
    if (!rig_.has(Injection::tick_hangs)) application_->tick();
    rig_.act(board_.actuation);
    collect();
    if (!rig_.has(Injection::background_hangs)) application_->background();
    if (++board_.ticks_since_fed > firmware::kWatchdogTicks) {
      ++resets_;
      reset(firmware::ResetCause::watchdog);
    }
  }
}

void VirtualDrive::run_seconds(double seconds) {
  run(static_cast<std::uint32_t>(std::llround(seconds * SoftwareBoard::kTickHz)));
}

firmware::Answer VirtualDrive::command(const firmware::Command& command) {
  if (!application_->submit(command)) throw std::logic_error("the drive has not taken the command before this one");
  run(1);
  const auto answer = application_->answer();
  if (!answer) throw std::runtime_error("the drive gave no answer within a tick; does its tick run?");
  return *answer;
}

firmware::BlockFinding VirtualDrive::commit(const Block& block) {
  constexpr int kMostTicks = 10;
  offered_ = block;
  application_->offer(offered_.bytes());
  for (int k = 0; k < kMostTicks && !application_->block_finding(); ++k) run(1);
  const auto finding = application_->block_finding();
  if (!finding) throw std::runtime_error("the drive did not decide on a block; does its background work run?");
  return *finding;
}

void VirtualDrive::collect() {
  std::array<std::uint32_t, firmware::TelemetrySetup::kMost + 2> words{};
  while (collect_) {
    const auto frame = application_->telemetry().read(words);
    if (frame.empty()) return;
    for (const std::uint32_t word : frame) hash_.add(word);
    ++frame_count_;
    if (keep_) frames_.push_back({frame[0], frame[1], {frame.begin() + 2, frame.end()}});
  }
}

}  // namespace flexspline::board
