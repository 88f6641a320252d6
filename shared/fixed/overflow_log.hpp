// Where number systems record what does not fit its format. For the host: shared/ has no exceptions, and the drive
// makes no coefficients.
#pragma once

#include <string_view>

namespace flexspline::fixed {

// The entries of the calling thread since the last clear(): their number, and the first one.
class OverflowLog {
 public:
  static void note(std::string_view what) {
    if (count_++ == 0) first_ = what;
  }
  static void clear() {
    count_ = 0;
    first_ = {};
  }
  static long count() { return count_; }
  static std::string_view first() { return first_; }

 private:
  static inline thread_local long count_ = 0;
  static inline thread_local std::string_view first_{};
};

}  // namespace flexspline::fixed
