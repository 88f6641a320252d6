// The watchdog is fed when every part of the application has reported since the last feed: if one part hangs, the drive
// is reset.
#pragma once

#include <atomic>
#include <cstdint>

namespace flexspline::firmware {

enum class Part : std::uint8_t { sensors, safety, control, output, background };

class Watchdog {
 public:
  // From the tick (all but the last part) or from background work. Each report is a byte of its own, as the tick may
  // interrupt background work while it writes its own.
  void report(Part part) { reports_[static_cast<std::uint8_t>(part)].store(1, std::memory_order_relaxed); }
  // At the end of a tick, which only comes there when none of its parts hangs.
  void report_tick() { report(Part::sensors), report(Part::safety), report(Part::control), report(Part::output); }
  // From background work: true when all have reported. Then all have to report again.
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
