// Random numbers of these machines alone; the same with every standard library, as its distributions are not.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace flexspline::worlds::machines {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : bits_(seed ^ 0x6A09E667F3BCC909ull) { bits_.discard(64); }

  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(bits_() >> 12) * 0x1.0p-52;
  }
  // Even over the logarithm.
  double scale_between(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  bool with_chance(double probability) { return between(0.0, 1.0) < probability; }
  std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(between(0.0, static_cast<double>(count))) % count;
  }
  double one_of(std::initializer_list<double> values) { return values.begin()[below(values.size())]; }
  double power_of_two(int lowest, int highest) {
    return std::exp2(lowest + static_cast<int>(below(static_cast<std::size_t>(highest - lowest + 1))));
  }
  double sign() { return with_chance(0.5) ? 1.0 : -1.0; }
  double angle() { return between(0.0, 2.0 * std::numbers::pi); }
  // Marsaglia's polar method.
  double normal() {
    for (;;) {
      const double x = between(-1.0, 1.0), y = between(-1.0, 1.0), s = x * x + y * y;
      if (s > 0.0 && s < 1.0) return x * std::sqrt(-2.0 * std::log(s) / s);
    }
  }
  std::uint64_t word() { return bits_(); }
  template <class T>
  void shuffle(std::vector<T>& items) {
    for (std::size_t k = items.size(); k > 1; --k) std::swap(items[k - 1], items[below(k)]);
  }

 private:
  std::mt19937_64 bits_;
};

}  // namespace flexspline::worlds::machines
