// Where number systems note what does not fit. For the host: shared/ has no exceptions, and the drive makes no
// coefficients.
#pragma once

#include <string_view>

namespace flexspline::fixed {

// What the calling thread found since it last cleared: how often, and what was first.
class Findings {
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
