// Independent pieces of work on all cores: records, balances, models. Results do not depend on how many there are.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "host/engine/estimation/cancellation.hpp"

namespace flexspline::estimation {

// Calls work(i) for each i below count, on as many threads as there are cores. After an exception none begins; after
// all have ended that of the lowest i is thrown again: the one that a loop would have met. After cancellation none
// continues or begins.
template <class Work>
void in_parallel(std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::size_t failed = count;
  std::mutex guard;
  const CancellationCheck* const outer = current_cancellation();
  std::atomic<bool> cancelled{false};
  std::exception_ptr why;
  const CancellationCheck check = [&] {
    if (cancelled) std::rethrow_exception(why);
    try {
      if (*outer) (*outer)();
    } catch (...) {
      const std::lock_guard lock(guard);
      if (!why) why = std::current_exception();
      cancelled = true;
      throw;
    }
  };
  const auto run = [&] {
    const CancellationScope as_the_caller(outer != nullptr ? &check : nullptr);
    for (std::size_t i = next++; i < count && !cancelled; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(guard);
        next = count;  // lower ones have begun already
        if (i < failed) {
          failed = i;
          failure = std::current_exception();
        }
      }
    }
  };
  const std::size_t threads = std::min<std::size_t>(std::max(1U, std::thread::hardware_concurrency()), count);
  std::vector<std::jthread> others;
  for (std::size_t t = 1; t < threads; ++t) others.emplace_back(run);
  run();
  others.clear();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace flexspline::estimation
