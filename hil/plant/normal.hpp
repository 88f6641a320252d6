#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

namespace flexspline::plant {

/// Numbers of a standard normal distribution by Marsaglia's polar method from the words of std::mt19937_64. Unlike
/// std::normal_distribution, whose method depends on the library, the same seed gives the same numbers everywhere. They
/// are made some hundred at a time: one at a time, each second word and each rejected pair is a branch that a processor
/// cannot predict.
class Normal {
 public:
  explicit Normal(std::uint64_t seed);
  double operator()() {
    if (next_ == made_) make();
    return numbers_[next_++];
  }

 private:
  using Engine = std::mt19937_64;  // only its constants are used
  static constexpr std::size_t kWords = Engine::state_size;
  static_assert(kWords % 2 == 0, "both words of a pair are of one round");

  void twist();
  void make();

  std::array<std::uint64_t, kWords> state_{};
  std::array<double, kWords> numbers_{};
  std::size_t next_ = 0;
  std::size_t made_ = 0;
};

}  // namespace flexspline::plant
