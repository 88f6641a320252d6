#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace flexspline::plant {

/// Numbers of a standard normal distribution by Marsaglia's polar method, two at a time. Unlike
/// std::normal_distribution, whose method each library chooses, the same generator gives the same numbers everywhere.
class Normal {
 public:
  double operator()(std::mt19937_64& generator) {
    if (has_second_) {
      has_second_ = false;
      return second_;
    }
    double x = 0.0, y = 0.0, square = 0.0;
    do {
      x = 2.0 * share(generator()) - 1.0;
      y = 2.0 * share(generator()) - 1.0;
      square = x * x + y * y;
    } while (square > 1.0 || square == 0.0);
    const double factor = std::sqrt(-2.0 * std::log(square) / square);
    second_ = x * factor;
    has_second_ = true;
    return y * factor;
  }

 private:
  /// From 0 to just below 1.
  static double share(std::uint64_t drawn) {
    constexpr double kJustBelow = 1.0 - 0x1p-53;
    const double share = static_cast<double>(drawn) * 0x1p-64;
    return share < 1.0 ? share : kJustBelow;
  }

  double second_ = 0.0;
  bool has_second_ = false;
};

}  // namespace flexspline::plant
