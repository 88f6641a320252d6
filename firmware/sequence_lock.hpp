// Sequence lock: the number is odd while an interrupt writes the data that background work copies. If it changed during
// a copy, the reader copies again. The writer interrupts the reader and never the reverse, so a copy is consistent as
// soon as no write interrupted it. After kTries copies that were interrupted the last one is returned, which may be
// inconsistent.
#pragma once

#include <atomic>
#include <cstdint>

namespace flexspline::firmware {

// Loads and stores of the tick that order what it shares with the background work that it interrupts. Both run on one
// core, which sees its own accesses in order: only the compiler has to keep it.
template <class T>
T load_in_tick(const std::atomic<T>& shared) {
  const T value = shared.load(std::memory_order_relaxed);
  std::atomic_signal_fence(std::memory_order_seq_cst);
  return value;
}
template <class T>
void store_in_tick(std::atomic<T>& shared, T value) {
  std::atomic_signal_fence(std::memory_order_seq_cst);
  shared.store(value, std::memory_order_relaxed);
}

class SequenceLock {
 public:
  void begin_write() {
    number_.store(number_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
  }
  void end_write() {
    std::atomic_signal_fence(std::memory_order_seq_cst);
    number_.store(number_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  // A copy takes a small part of the time between two writes, so the second one is consistent.
  template <class T>
  T read(const T& shared) const {
    for (int tries = 0;; ++tries) {
      const std::uint32_t before = number_.load(std::memory_order_relaxed);
      std::atomic_signal_fence(std::memory_order_seq_cst);
      T copy = shared;
      std::atomic_signal_fence(std::memory_order_seq_cst);
      if (tries == kTries || (number_.load(std::memory_order_relaxed) == before && (before & 1) == 0)) return copy;
    }
  }

 private:
  static constexpr int kTries = 8;
  std::atomic<std::uint32_t> number_{0};
};

}  // namespace flexspline::firmware
