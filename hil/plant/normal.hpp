#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

namespace flexspline::plant {

/// Numbers of a standard normal distribution by Marsaglia's polar method from the words of std::mt19937_64. Unlike
/// std::normal_distribution, whose method each library chooses, the same seed gives the same numbers everywhere. They
/// are made some hundred at a time: one by one, each second word and each pair that is thrown away is a branch that no
/// processor foresees.
class Normal {
 public:
  explicit Normal(std::uint64_t seed);
  double operator()() {
    if (next_ == made_) make();
    return numbers_[next_++];
  }

 private:
  using Engine = std::mt19937_64;  // of which only the numbers are taken that define it
  static constexpr std::size_t kWords = Engine::state_size;
  static_assert(kWords % 2 == 0, "a pair of words is of one round");

  void turn();
  void make();

  std::array<std::uint64_t, kWords> state_{};
  std::array<double, kWords> numbers_{};
  std::size_t next_ = 0;
  std::size_t made_ = 0;
};

}  // namespace flexspline::plant
