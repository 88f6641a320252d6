// A trial fixed-point number system: enough to run three effects as a drive would, with a type of its own for each kind
// of number, so that an effect which mixes them up does not compile. It settles what an effect may ask of a number
// system before the one of the drive is written.
//
//   Value   int32, 2^-27 of a base        Angle, Step   int64, 2^-32 of a turn; Angle wraps
//   State   int64, 2^-60                  Sum           int64, 2^-44 of a base, narrowed once at the end
//
// What takes a double makes coefficients or test signals; all else is integer arithmetic. No step can overflow for
// inputs whose products are below 16 bases, and the sanitizer sees it where one does: left shifts are multiplications.
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace flexspline::tests {

class TrialFixed {
 public:
  static constexpr int kValueBits = 27;
  static constexpr int kAngleBits = 32;
  static constexpr int kStateBits = 60;
  static constexpr int kSumBits = 44;
  static constexpr int kTravelBits = 58;
  static constexpr int kMantissaBits = 30;
  static constexpr double kLargestValue = 15.99;  // of a signal, and of what a gain may give
  static constexpr double kLargestTravel = 31.0;  // exp(-31) is 3e-14: all is forgotten

  using Parameter = double;

  struct Value {
    std::int32_t raw = 0;
    friend constexpr auto operator<=>(Value, Value) = default;
    friend constexpr Value operator+(Value a, Value b) { return {a.raw + b.raw}; }
    friend constexpr Value operator-(Value a, Value b) { return {a.raw - b.raw}; }
    friend constexpr Value operator-(Value a) { return {-a.raw}; }
  };
  struct Step {
    std::int64_t raw = 0;
  };
  struct Angle {
    std::int64_t raw = 0;
    friend constexpr Step operator-(Angle a, Angle b) {
      return {static_cast<std::int64_t>(static_cast<std::uint64_t>(a.raw) - static_cast<std::uint64_t>(b.raw))};
    }
  };
  struct Sum {
    std::int64_t raw = 0;
    friend constexpr Sum operator+(Sum a, Sum b) { return {a.raw + b.raw}; }
    constexpr Sum& operator+=(Sum b) { return *this = *this + b; }
  };
  struct State {
    std::int64_t raw = 0;
  };
  // A distance over a characteristic length, before the exponential: never stands in an effect.
  struct Travel {
    std::int64_t raw = 0;
  };
  // mantissa 2^(exponent - 30). The input is clamped to `limit` before it is multiplied, so the product always fits.
  struct Gain {
    std::int32_t mantissa = 0;
    int exponent = 0;
    std::int32_t limit = 0;
    constexpr Sum operator*(Value x) const {
      return {shift_right(product(*this, x.raw), kMantissaBits + kValueBits - kSumBits - exponent)};
    }
  };
  // The same per turn of angle.
  struct StepGain {
    std::int32_t mantissa = 0;
    int exponent = 0;
    std::int32_t limit = 0;
  };

  // On the host: coefficients and signals from double. Errors: std::range_error where a number does not fit its format.
  static Value value(double x) {
    if (!(std::abs(x) <= kLargestValue)) throw std::range_error("a value must be below 16 bases: choose a larger base");
    return {static_cast<std::int32_t>(std::llround(std::ldexp(x, kValueBits)))};
  }
  static Gain gain(double x) { return coefficient<Gain>(x, kLargestValue, kValueBits); }
  static StepGain step_gain(double x) { return coefficient<StepGain>(x, kLargestTravel, kAngleBits); }
  static Angle angle(double turns) { return {std::llround(std::ldexp(turns, kAngleBits))}; }

  // From here on integers only.
  static constexpr Value times(Value a, Value b) {
    return {static_cast<std::int32_t>(shift_right(std::int64_t{a.raw} * b.raw, kValueBits))};
  }
  static constexpr Value scaled(Gain g, Value x) {
    return {static_cast<std::int32_t>(shift_right(product(g, x.raw), kMantissaBits - g.exponent))};
  }
  static constexpr Travel travel(StepGain g, Step x) {
    return {shift_right(product(g, x.raw), kMantissaBits + kAngleBits - kTravelBits - g.exponent)};
  }
  static constexpr Value magnitude(Value x) { return {x.raw < 0 ? -x.raw : x.raw}; }
  static constexpr Step magnitude(Step x) { return {x.raw < 0 ? -x.raw : x.raw}; }
  static constexpr State sign(Step x) {
    constexpr std::int64_t kOne = std::int64_t{1} << kStateBits;
    return {x.raw > 0 ? kOne : x.raw < 0 ? -kOne : 0};
  }
  static constexpr Value clamp(Value x, Value limit) { return std::clamp(x, -limit, limit); }
  static constexpr Sum sum(Value x) { return {std::int64_t{x.raw} * (std::int64_t{1} << (kSumBits - kValueBits))}; }
  static constexpr Value narrow(State x) {
    return {static_cast<std::int32_t>(shift_right(x.raw, kStateBits - kValueBits))};
  }
  // |from - target| at most 2 and 0 <= share <= 1; a share of one leaves `from` as it is, to the bit.
  static constexpr State relax(State from, State target, State share) {
    const std::int64_t distance = from.raw - target.raw;
    const auto kept = static_cast<std::int64_t>(multiply(
        static_cast<std::uint64_t>(distance < 0 ? -distance : distance), static_cast<std::uint64_t>(share.raw)));
    return {target.raw + (distance < 0 ? -kept : kept)};
  }
  // exp(-x) for 0 <= x < 32, within 1e-16 absolute: x = k ln 2 + r, Taylor series of degree 16 in r (its remainder is
  // below 6e-18), nested, each product within 2^-60. What is lost over the smallest x, 1 - exp(-x), so is as exact as
  // x.
  static constexpr State exp_negative(Travel x) {
    constexpr std::uint64_t kLn2 = 0x2C5C85FDF473DE7;  // 2^58 ln 2
    constexpr std::uint64_t kOne = std::uint64_t{1} << kStateBits;
    const auto size = static_cast<std::uint64_t>(x.raw);
    const std::uint64_t halvings = size / kLn2;
    const std::uint64_t rest = (size - halvings * kLn2) << (kStateBits - kTravelBits);
    std::uint64_t series = kOne;
    for (std::uint64_t n = 16; n > 0; --n) series = kOne - multiply(rest, series) / n;
    return {static_cast<std::int64_t>(series >> halvings)};
  }

 private:
  static constexpr std::int64_t shift_right(std::int64_t x, int bits) {
    if (bits <= 0) return x * (std::int64_t{1} << -bits);
    if (bits >= 63) return 0;
    return (x + (std::int64_t{1} << (bits - 1))) >> bits;
  }
  // a b 2^-60 rounded down, for a up to 2^61 and b up to 2^60, from four products of 32 bits.
  static constexpr std::uint64_t multiply(std::uint64_t a, std::uint64_t b) {
    constexpr std::uint64_t kLow = 0xFFFFFFFF;
    const std::uint64_t middle = (a >> 32) * (b & kLow) + (a & kLow) * (b >> 32) + ((a & kLow) * (b & kLow) >> 32);
    return ((a >> 32) * (b >> 32) << 4) + (middle >> 28);
  }
  template <class G>
  static constexpr std::int64_t product(G g, std::int64_t x) {
    return g.mantissa * std::clamp<std::int64_t>(x, -g.limit, g.limit);
  }
  template <class G>
  static G coefficient(double x, double largest, int input_bits) {
    if (!std::isfinite(x)) throw std::range_error("a gain must be finite");
    const double limit = std::floor(std::ldexp(largest / std::max(std::abs(x), 1e-300), input_bits));
    if (limit < 1.0) throw std::range_error("a gain leaves no input that it could be applied to: choose other bases");
    G g;
    g.mantissa = static_cast<std::int32_t>(std::llround(std::ldexp(std::frexp(x, &g.exponent), kMantissaBits)));
    g.limit = static_cast<std::int32_t>(std::min(limit, double{std::numeric_limits<std::int32_t>::max()}));
    return g;
  }
};

// Back to double, for comparison.
inline double to_double(TrialFixed::Value x) {
  return std::ldexp(x.raw, -TrialFixed::kValueBits);
}
inline double to_double(TrialFixed::Sum x) {
  return std::ldexp(static_cast<double>(x.raw), -TrialFixed::kSumBits);
}
inline double to_double(TrialFixed::State x) {
  return std::ldexp(static_cast<double>(x.raw), -TrialFixed::kStateBits);
}

}  // namespace flexspline::tests
