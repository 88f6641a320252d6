#include "hil/board/brain.hpp"

namespace flexspline::board {

Block::Block(const firmware::Parameters& parameters)
    : words_((firmware::kBlockBytes + 7) / 8), size_(firmware::kBlockBytes) {
  firmware::write_block(parameters, bytes());
}

void SoftwareBrain::start(const Block& block, const firmware::TelemetrySetup& telemetry, firmware::ResetCause cause) {
  flash_ = block;
  telemetry_ = telemetry;
  board_ = {};
  board_.cause = cause;
  application_ = std::make_unique<firmware::Application<SoftwareBoard>>(board_);
  application_->telemetry().configure(telemetry_);
  if (!flash_.empty()) application_->offer(flash_.bytes());
  application_->background();  // as a board's main() does before it starts the timer
}

firmware::LockStepUp SoftwareBrain::tick(const firmware::LockStepDown& down) {
  board_.readings = down.readings;
  board_.overrun = down.overrun;
  firmware::LockStepUp up;
  if (!tick_hangs_) up = firmware::lock_step(*application_, down);
  up.actuation = board_.actuation;
  if (!background_hangs_) application_->background();
  if (++board_.ticks_since_fed > firmware::kWatchdogTicks) {
    ++resets_;
    const Block kept = flash_;
    start(kept, telemetry_, firmware::ResetCause::watchdog);
    up = {};
  }
  return up;
}

}  // namespace flexspline::board
