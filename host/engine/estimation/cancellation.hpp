// Cancellation of long work: a fit asks at each record and each set of columns whether to go on.
#pragma once

#include <functional>
#include <utility>

namespace flexspline::estimation {

using CancellationCheck = std::function<void()>;

namespace detail {
inline thread_local const CancellationCheck* check_of_thread = nullptr;
}

// For as long as it lives, work of this thread (and what it does in_parallel) calls `check` regularly; an exception
// from it cancels the work. `check` is called from several threads. Null changes nothing.
class CancellationScope {
 public:
  explicit CancellationScope(const CancellationCheck* check) : before_(detail::check_of_thread) {
    if (check != nullptr) detail::check_of_thread = check;
  }
  ~CancellationScope() { detail::check_of_thread = before_; }
  CancellationScope(const CancellationScope&) = delete;
  CancellationScope& operator=(const CancellationScope&) = delete;

 private:
  const CancellationCheck* before_;
};

// The check for threads that are started for this work; null: none.
inline const CancellationCheck* current_cancellation() {
  return detail::check_of_thread;
}

// Throws what the check throws; costs nothing where there is none.
inline void throw_if_cancelled() {
  if (detail::check_of_thread != nullptr && *detail::check_of_thread) (*detail::check_of_thread)();
}

}  // namespace flexspline::estimation
