// The watchdog is fed when the tick and background work have both reported since the last feed: if one of them hangs,
// the drive is reset.
#pragma once

#include <atomic>
#include <cstdint>

namespace flexspline::firmware {

enum class Part : std::uint8_t { tick, background };

class Watchdog {
 public:
  // At the end of the tick, or from background work. Each report is a byte of its own, as the tick may interrupt
  // background work while it writes its own.
  void report(Part part) { reports_[static_cast<std::uint8_t>(part)].store(1, std::memory_order_relaxed); }
  // From background work: true when both have reported. Then both have to report again.
  bool all_reported() {
    for (const auto& report : reports_)
      if (report.load(std::memory_order_relaxed) == 0) return false;
    for (auto& report : reports_) report.store(0, std::memory_order_relaxed);
    return true;
  }

 private:
  std::atomic<std::uint8_t> reports_[2]{};
};

}  // namespace flexspline::firmware
