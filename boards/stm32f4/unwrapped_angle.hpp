// An absolute angle within a turn as a counter that goes on over the turns. It moves by less than half a turn between
// two samples.
#pragma once

#include <cstdint>

namespace flexspline::stm32f4 {

// All members are zero at first, or the whole drive would take flash memory for its initial value.
template <std::uint32_t counts>
class UnwrappedAngle {
 public:
  void reverse(bool reversed) { reversed_ = reversed; }
  // `angle`: below `counts`.
  void add(std::uint32_t angle) {
    const std::uint32_t now = reversed_ ? (counts - angle) % counts : angle;
    const std::uint32_t moved = (now - total_) % counts;
    total_ += started_ && moved >= counts / 2 ? moved - counts : moved;
    started_ = true;
  }
  std::uint32_t total() const { return total_; }  // begins within a turn

 private:
  std::uint32_t total_ = 0;
  bool reversed_ = false;
  bool started_ = false;
};

}  // namespace flexspline::stm32f4
