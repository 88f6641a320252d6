// Random numbers that are the same with every standard library: its distributions are not.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <random>

namespace flexspline::worlds {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed * 0x9E3779B97F4A7C15ull + 0xD1B54A32D192ED03ull) {}

  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
  bool chance(double probability) { return uniform() < probability; }
  int integer(int low, int high) { return low + static_cast<int>(uniform() * (high - low + 1)); }
  double sign() { return chance(0.5) ? 1.0 : -1.0; }
  template <class T>
  T one_of(std::initializer_list<T> values) {
    return *(values.begin() + integer(0, static_cast<int>(values.size()) - 1));
  }
  // Box and Muller; one of the pair is enough here.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

// First-order autoregressive noise of unit variance.
class ColouredNoise {
 public:
  explicit ColouredNoise(double correlation) : correlation_(correlation) {}
  double next(Random& random) {
    const double drive = std::sqrt(1.0 - correlation_ * correlation_) * random.normal();
    return value_ = correlation_ * value_ + drive;
  }

 private:
  double correlation_;
  double value_ = 0.0;
};

}  // namespace flexspline::worlds
