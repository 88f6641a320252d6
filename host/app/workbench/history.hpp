// Steps with undo and redo.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <vector>

namespace flexspline::workbench {

// A list of steps with a present one; never empty. Later steps can be redone until a new step replaces them.
template <class Step>
class History {
 public:
  explicit History(Step first) { steps_.push_back(std::move(first)); }

  const Step& current() const { return steps_[at_]; }
  const Step& operator[](std::size_t k) const { return steps_.at(k); }
  std::size_t at() const { return at_; }
  std::size_t size() const { return steps_.size(); }

  void take(Step step) {
    steps_.resize(at_ + 1, steps_.front());
    steps_.push_back(std::move(step));
    ++at_;
  }
  // False where there is no step to undo, or to redo.
  bool undo() {
    if (at_ == 0) return false;
    --at_;
    return true;
  }
  bool redo() {
    if (at_ + 1 == steps_.size()) return false;
    ++at_;
    return true;
  }
  // Throws std::out_of_range where there is no such step.
  void go(std::size_t step) {
    if (step >= steps_.size()) throw std::out_of_range("there is no such step");
    at_ = step;
  }

 private:
  std::vector<Step> steps_;
  std::size_t at_ = 0;
};

}  // namespace flexspline::workbench
