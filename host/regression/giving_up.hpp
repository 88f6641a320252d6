// Long work that nobody wants any more ends soon: a fit asks at each record and each set of columns.
#pragma once

#include <functional>
#include <utility>

namespace flexspline::regression {

using Asking = std::function<void()>;

namespace detail {
inline thread_local const Asking* asked_of_thread = nullptr;
}

// For as long as it lives, work of this thread (and what it does in_parallel) asks `ask` again and again; what that
// throws ends the work. `ask` is called from several threads. Null changes nothing.
class MayGiveUp {
 public:
  explicit MayGiveUp(const Asking* ask) : before_(detail::asked_of_thread) {
    if (ask != nullptr) detail::asked_of_thread = ask;
  }
  ~MayGiveUp() { detail::asked_of_thread = before_; }
  MayGiveUp(const MayGiveUp&) = delete;
  MayGiveUp& operator=(const MayGiveUp&) = delete;

 private:
  const Asking* before_;
};

// What threads that are made for this work have to ask; null: nobody.
inline const Asking* asked_here() {
  return detail::asked_of_thread;
}

// Throws what the one who is asked throws; costs nothing where nobody is.
inline void ask_whether_to_give_up() {
  if (detail::asked_of_thread != nullptr && *detail::asked_of_thread) (*detail::asked_of_thread)();
}

}  // namespace flexspline::regression
