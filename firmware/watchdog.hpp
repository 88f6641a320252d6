// The watchdog is fed when every part of the application has reported since it was fed last: one part that hangs is
// enough to reset the drive.
#pragma once

#include <atomic>
#include <cstdint>

namespace flexspline::firmware {

enum class Part : std::uint8_t { sensors, safety, control, output, background };

class Watchdog {
 public:
  // From the tick (all but the last part) or from background work. A report is one byte each, as a tick may interrupt
  // background work in the middle of its own.
  void report(Part part) { reports_[static_cast<std::uint8_t>(part)].store(1, std::memory_order_relaxed); }
  // From background work: true when all have reported, and then all have to report again.
  bool all_reported() {
    for (const auto& report : reports_)
      if (report.load(std::memory_order_relaxed) == 0) return false;
    for (auto& report : reports_) report.store(0, std::memory_order_relaxed);
    return true;
  }

 private:
  std::atomic<std::uint8_t> reports_[5]{};
};

}  // namespace flexspline::firmware
