#pragma once

#include <cstdint>

#include "firmware/board.hpp"

namespace flexspline::board {

/// The board of the desktop: samples are put in, the actuation is taken out.
class SoftwareBoard {
 public:
  static constexpr std::uint32_t kTickHz = 20'000;
  static constexpr std::uint32_t kTelemetryWords = 2048;

  firmware::Readings read() const { return readings; }
  void actuate(const firmware::Actuation& wanted) { actuation = wanted; }
  bool tick_overrun() const { return overrun; }
  void feed_watchdog() { ticks_since_fed = 0; }
  firmware::ResetCause reset_cause() const { return cause; }

  firmware::Readings readings{};
  firmware::Actuation actuation{};
  bool overrun = false;
  std::uint32_t ticks_since_fed = 0;
  firmware::ResetCause cause = firmware::ResetCause::power;
};

}  // namespace flexspline::board
