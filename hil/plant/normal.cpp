#include "hil/plant/normal.hpp"

#include <bit>
#include <cmath>

namespace flexspline::plant {
namespace {

// Rounds as a conversion does. A conversion of unsigned words has a branch and is not vectorised, so both halves become
// the lower bits of a double, and only the last sum rounds. From 0 to just below 1.
double share(std::uint64_t drawn) {
  constexpr double kUpper = 0x1p84, kLower = 0x1p52, kJustBelow = 1.0 - 0x1p-53;
  const auto upper = std::bit_cast<double>(std::bit_cast<std::uint64_t>(kUpper) | drawn >> 32U);
  const auto lower = std::bit_cast<double>(std::bit_cast<std::uint64_t>(kLower) | (drawn & 0xFFFFFFFFU));
  const double share = ((upper - (kUpper + kLower)) + lower) * 0x1p-64;
  return share < kJustBelow ? share : kJustBelow;
}

}  // namespace

Normal::Normal(std::uint64_t seed) {
  for (std::uint64_t i = 0; i < kWords; ++i) {
    state_[i] = seed;
    seed = Engine::initialization_multiplier * (seed ^ seed >> (Engine::word_size - 2)) + i + 1;
  }
}

// Computes the next state of the generator (twist).
void Normal::twist() {
  constexpr std::uint64_t kLower = (std::uint64_t{1} << Engine::mask_bits) - 1;
  constexpr std::size_t kShift = Engine::shift_size;
  const auto twisted = [this](std::size_t k, std::size_t after, std::size_t shifted) {
    const std::uint64_t word = (state_[k] & ~kLower) | (state_[after] & kLower);
    state_[k] = state_[shifted] ^ word >> 1U ^ ((0 - (word & 1U)) & Engine::xor_mask);
  };
  std::size_t k = 0;
  for (; k < kWords - kShift; ++k) twisted(k, k + 1, k + kShift);
  for (; k < kWords - 1; ++k) twisted(k, k + 1, k + kShift - kWords);
  twisted(k, 0, kShift - 1);
}

void Normal::make() {
  twist();
  std::array<double, kWords> drawn;
  for (std::size_t i = 0; i < kWords; ++i) {
    std::uint64_t word = state_[i];
    word ^= (word >> Engine::tempering_u) & Engine::tempering_d;
    word ^= (word << Engine::tempering_s) & Engine::tempering_b;
    word ^= (word << Engine::tempering_t) & Engine::tempering_c;
    word ^= word >> Engine::tempering_l;
    drawn[i] = 2.0 * share(word) - 1.0;
  }
  // Compacts the pairs within the circle.
  std::array<double, kWords / 2> squares;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < kWords; i += 2) {
    const double x = drawn[i], y = drawn[i + 1], square = x * x + y * y;
    drawn[2 * pairs] = x;
    drawn[2 * pairs + 1] = y;
    squares[pairs] = square;
    pairs += (square <= 1.0 ? 1U : 0U) & (square != 0.0 ? 1U : 0U);
  }
  for (std::size_t i = 0; i < pairs; ++i) {
    const double factor = std::sqrt(-2.0 * std::log(squares[i]) / squares[i]);
    numbers_[2 * i] = drawn[2 * i + 1] * factor;
    numbers_[2 * i + 1] = drawn[2 * i] * factor;
  }
  made_ = 2 * pairs;
  next_ = 0;
}

}  // namespace flexspline::plant
