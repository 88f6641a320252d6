// How long a drive has said nothing while its host listened.
#pragma once

#include <algorithm>
#include <chrono>

namespace flexspline::drive {

// A host that stands still itself, on a busy machine or in a debugger, hears nothing either: that is no silence of the
// drive. So a wait for a message counts for at most twice its limit, however long it took.
class Silence {
 public:
  using Clock = std::chrono::steady_clock;

  Silence(Clock::duration longest, Clock::time_point now) : longest_(longest), since_(now) {}

  // After a wait of at most `limit` for a message.
  void waited(Clock::duration limit, bool heard, Clock::time_point now) {
    quiet_ = heard ? Clock::duration::zero() : quiet_ + std::min(now - since_, 2 * limit);
    since_ = now;
  }
  bool is_too_long() const { return quiet_ > longest_; }

 private:
  Clock::duration longest_, quiet_{};
  Clock::time_point since_;
};

}  // namespace flexspline::drive
