// A copy of what an interrupt writes is whole, wherever in the copy the interrupt comes.
#include "firmware/sequence_lock.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace flexspline::sequence_lock_test {
namespace {

// Its copy can be interrupted between its halves.
struct Halves {
  int first = 0;
  int second = 0;
  static inline std::function<void()> between;
  Halves() = default;
  Halves(const Halves& other) : first(other.first) {
    if (between) between();
    second = other.second;
  }
};

TEST(SequenceLock, ACopyThatIsInterruptedOnceOrTwiceIsTakenAgainUntilItIsWhole) {
  for (int interrupts = 0; interrupts <= 3; ++interrupts) {
    firmware::SequenceLock lock;
    Halves shared;
    int left = interrupts;
    Halves::between = [&] {
      if (left-- <= 0) return;
      lock.begin_write();
      ++shared.first, ++shared.second;
      lock.end_write();
    };
    const Halves copy = lock.read(shared);
    Halves::between = nullptr;
    EXPECT_EQ(copy.first, copy.second);
    EXPECT_EQ(copy.first, interrupts);
  }
}

}  // namespace
}  // namespace flexspline::sequence_lock_test
