// Interval arithmetic over the drive's number system: all results of an effect for inputs between two bounds, so that
// one run proves that no value leaves its range. Ends are computed with the drive's own arithmetic; functions that need
// not be monotone to the last unit get a margin. For the host.
#pragma once

#include <array>
#include <cstdint>

#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/system.hpp"

namespace flexspline::fixed {

// Raw numbers in the format of a `Value`, `State` or `Sum`; both ends are included.
template <class Format>
struct Range {
  std::int64_t low = 0;
  std::int64_t high = 0;
};
template <class Format>
constexpr Range<Format> hull(Range<Format> a, Range<Format> b) {
  return {a.low < b.low ? a.low : b.low, a.high > b.high ? a.high : b.high};
}
// The smallest and the largest magnitude in it.
template <class Format>
constexpr std::int64_t least(Range<Format> x) {
  return x.low > 0 ? x.low : x.high < 0 ? -x.high : 0;
}
template <class Format>
constexpr std::int64_t most(Range<Format> x) {
  return x.high > -x.low ? x.high : -x.low;
}

namespace detail {
inline Fixed::Value value_of(std::int64_t raw) {
  return {{static_cast<std::int32_t>(raw)}};
}
inline Fixed::State state_of(std::int64_t raw) {
  return {{raw}};
}
inline constexpr std::int64_t kValueMost = 0x7FFFFFFF;
inline constexpr std::int64_t kStateMost = 0x7FFFFFFFFFFFFFFF;
inline Range<Value> value_range(std::int64_t low, std::int64_t high) {
  if (low < -kValueMost || high > kValueMost) OverflowLog::note("a value may leave its range");
  return {limited(low, -kValueMost, kValueMost), limited(high, -kValueMost, kValueMost)};
}
// Sums of states saturate here, so that they can be distinguished from those that fit.
inline std::int64_t state_sum(std::int64_t a, std::int64_t b) {
  const std::int64_t sum = UncheckedArithmetic::state_sum(a, b);
  if ((a < 0) != (b < 0) || (sum < 0) == (a < 0)) return sum;
  OverflowLog::note("a sum of states may leave its range");
  return a < 0 ? -kStateMost : kStateMost;
}
}  // namespace detail

inline Range<Value> operator+(Range<Value> a, Range<Value> b) {
  return detail::value_range(a.low + b.low, a.high + b.high);
}
inline Range<Value> operator-(Range<Value> a) {
  return {-a.high, -a.low};
}
inline Range<Value> operator-(Range<Value> a, Range<Value> b) {
  return a + -b;
}
inline Range<State> operator-(Range<State> a) {
  return {-a.high, -a.low};
}
inline Range<State> operator+(Range<State> a, Range<State> b) {
  return {detail::state_sum(a.low, b.low), detail::state_sum(a.high, b.high)};
}
inline Range<State> operator-(Range<State> a, Range<State> b) {
  return a + -b;
}
// A sum is far below the end of its word, so that ends of many terms can still be added here.
inline constexpr std::int64_t kSumMost = std::int64_t{1} << 61;
inline Range<Sum> operator+(Range<Sum> a, Range<Sum> b) {
  const Range<Sum> sum{a.low + b.low, a.high + b.high};
  if (sum.low < -kSumMost || sum.high > kSumMost) OverflowLog::note("a sum of torques is not below 128 bases");
  return {limited(sum.low, -kSumMost, kSumMost), limited(sum.high, -kSumMost, kSumMost)};
}
inline Range<Sum>& operator+=(Range<Sum>& a, Range<Sum> b) {
  return a = a + b;
}

struct Intervals {
  using Parameter = double;
  using Value = Range<fixed::Value>;
  using State = Range<fixed::State>;
  using Sum = Range<fixed::Sum>;
  struct Scaled {
    fixed::RatioGain gain;
    Value signal;
  };
  using Ratio = Scaled;
  using DecayFactor = State;
  struct Travel {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
  };
  // A position may be anywhere and a step of any size: travels saturate.
  struct Step {};
  struct Angle {
    friend constexpr Step operator-(Angle, Angle) { return {}; }
  };
  struct Weight : fixed::Weight {
    friend Sum operator*(const Weight& w, Value x) {
      constexpr std::int64_t kSixteen = std::int64_t{16} << kSumBits;
      const std::int64_t a = w.raw * x.low, b = w.raw * x.high;
      if (limited(a, 1 - kSixteen, kSixteen - 1) != a || limited(b, 1 - kSixteen, kSixteen - 1) != b)
        OverflowLog::note("a torque may not be below 16 bases");
      return a < b ? Sum{a, b} : Sum{b, a};
    }
  };
  using Harmonic = fixed::Harmonic;
  struct Gain : fixed::Gain {
    friend Sum operator*(const Gain& g, Value x) {
      const auto end = [&](std::int64_t raw) { return (Fixed::Gain{g} * detail::value_of(raw)).raw; };
      return g.ordered<Sum>(x, end);
    }
    // The result is between its values at both ends. An input beyond the limit would be clamped, so that the drive
    // would not compute the model.
    template <class Result, class End>
    Result ordered(Value x, End&& end) const {
      if (most(x) > limit) OverflowLog::note("a gain may reach its limit: its result is not below 16 bases");
      const std::int64_t a = end(x.low);
      const std::int64_t b = end(x.high);
      return a < b ? Result{a, b} : Result{b, a};
    }
  };
  using StepGain = fixed::StepGain;
  using RatioGain = fixed::RatioGain;
  using Share = fixed::Share;
  using Exponent = fixed::Exponent;
  using Order = fixed::Order;
  struct Wave {
    Value cosine;
    Value sine;
  };

  static Weight weight(double x) { return {make_weight(x)}; }
  static Harmonic harmonic(double radians_per_turn, double cosine, double sine) {
    return make_harmonic(radians_per_turn, cosine, sine);
  }
  static Gain gain(double x) { return {make_gain(x)}; }
  static StepGain step_gain(double x) { return make_step_gain(x); }
  static RatioGain ratio_gain(double x) { return make_ratio_gain(x); }
  static Value value(double x) { return exactly(Fixed::value(x)); }
  static Share share(double x) { return make_share(x); }
  static Exponent exponent(double x) { return make_exponent(x); }
  static Order order(double radians_per_turn) { return make_order(radians_per_turn); }
  static double power(double x, double exponent) { return Fixed::power(x, exponent); }

  static Value one() { return exactly(Fixed::one()); }
  static Value times(Value a, Value b) {
    const auto corner = [](std::int64_t x, std::int64_t y) { return (x * y) >> kValueBits; };
    return detail::value_range(
        smallest(corner(a.low, b.low), corner(a.low, b.high), corner(a.high, b.low), corner(a.high, b.high)),
        largest(corner(a.low, b.low), corner(a.low, b.high), corner(a.high, b.low), corner(a.high, b.high)));
  }
  static Value scaled(const Gain& g, Value x) {
    return g.ordered<Value>(
        x, [&](std::int64_t raw) { return std::int64_t{Fixed::scaled(Fixed::Gain{g}, detail::value_of(raw)).raw}; });
  }
  static Scaled ratio(const RatioGain& g, Value x) { return {g, x}; }
  static Sum sum(Value x) {
    return {Fixed::sum(detail::value_of(x.low)).raw, Fixed::sum(detail::value_of(x.high)).raw};
  }
  static Value narrow(Sum x) { return {Fixed::narrow(fixed::Sum{x.low}).raw, Fixed::narrow(fixed::Sum{x.high}).raw}; }
  static Value narrow(State x) {
    return {Fixed::narrow(detail::state_of(x.low)).raw, Fixed::narrow(detail::state_of(x.high)).raw};
  }
  static State widen(Value x) {
    return {Fixed::widen(detail::value_of(x.low)).raw, Fixed::widen(detail::value_of(x.high)).raw};
  }

  static Step magnitude(Step x) { return x; }
  static Value magnitude(Value x) { return {least(x), most(x)}; }
  static State magnitude(State x) { return {least(x), most(x)}; }
  static Value clamp(Value x, Value limit) { return between(x, -limit, limit); }
  static State clamp(State x, Value limit) {
    const Fixed::Value most = detail::value_of(limit.high);
    return {Fixed::clamp(detail::state_of(x.low), most).raw, Fixed::clamp(detail::state_of(x.high), most).raw};
  }
  static Value between(Value x, Value low, Value high) {
    return {limited(x.low, low.low, high.low), limited(x.high, low.high, high.high)};
  }
  static State clamp_to_one(State x) { return clamped(x, kOne); }
  static State bounded(State x) { return clamped(x, 4 * kOne); }
  static Value by_sign(Value x, Value a, Value b) { return x.low >= 0 ? a : x.high < 0 ? b : hull(a, b); }
  static State sign(Step) { return {-kOne, kOne}; }
  static State sign(Value x) {
    return {Fixed::sign(detail::value_of(x.low)).raw, Fixed::sign(detail::value_of(x.high)).raw};
  }

  static State signal(const StepGain& g, Step) {
    const std::int64_t most = g.mantissa == 0 ? 0 : 2 * kOne;
    return {-most, most};
  }
  static Travel travel(const StepGain& g, Step) { return {0, g.mantissa == 0 ? 0 : kLargestTravel}; }
  static Travel travel(const Gain& g, Value x) {
    return {Fixed::travel(Fixed::Gain{g}, detail::value_of(x.low)).raw,
            Fixed::travel(Fixed::Gain{g}, detail::value_of(x.high)).raw};
  }
  static Travel times(Travel t, Value x) {
    return {Fixed::times(fixed::Travel{t.low}, detail::value_of(x.low)).raw,
            Fixed::times(fixed::Travel{t.high}, detail::value_of(x.high)).raw};
  }
  static Travel over(Travel t, Value x) {
    return {Fixed::over({t.low}, detail::value_of(x.high)).raw, Fixed::over({t.high}, detail::value_of(x.low)).raw};
  }
  static Travel times_power(Travel t, State x, Exponent e) {
    const std::uint64_t a = Fixed::times_power({t.low}, detail::state_of(e.raw < 0 ? most(x) : least(x)), e).raw;
    const std::uint64_t b = Fixed::times_power({t.high}, detail::state_of(e.raw < 0 ? least(x) : most(x)), e).raw;
    return {a, b};
  }
  static State step(Travel t, Value x) {
    const auto corner = [](std::uint64_t a, std::int64_t b) { return Fixed::step({a}, detail::value_of(b)).raw; };
    return {smallest(corner(t.low, x.low), corner(t.high, x.low)),
            largest(corner(t.low, x.high), corner(t.high, x.high))};
  }
  static State times(State a, Value b) {
    const auto corner = [](std::int64_t x, std::int64_t y) {
      return Checked::times(Checked::State{{x}}, Checked::Value{{static_cast<std::int32_t>(y)}}).raw;
    };
    return {smallest(corner(a.low, b.low), corner(a.low, b.high), corner(a.high, b.low), corner(a.high, b.high)),
            largest(corner(a.low, b.low), corner(a.low, b.high), corner(a.high, b.low), corner(a.high, b.high))};
  }
  static State times(State a, Share b) {
    return {Fixed::times(detail::state_of(a.low), b).raw, Fixed::times(detail::state_of(a.high), b).raw};
  }
  // For a share between zero and one. The drive may pass the target by a unit, but not by more in any number of ticks.
  static State relax(State from, State target, State) {
    constexpr std::int64_t kUnit = std::int64_t{1} << (kStateBits - 27);
    constexpr std::int64_t kMost = 8 * kOne;
    const auto apart = [](std::int64_t high, std::int64_t low) { return high - low >= kMost; };
    if (target.low <= -kMost || target.high >= kMost || from.low <= -kMost || from.high >= kMost ||
        apart(from.high, target.low) || apart(target.high, from.low)) {
      OverflowLog::note("a distance to relax over may leave its range");
      return {-kMost, kMost};
    }
    return hull(from, State{target.low - kUnit, target.high + kUnit});
  }

  static State exp_negative(Travel x) {
    return share(Fixed::exp_negative(fixed::Travel{x.high}), Fixed::exp_negative(fixed::Travel{x.low}));
  }
  static State q_exp_negative(Travel x, Exponent q) {
    return share(Fixed::q_exp_negative({x.high}, q), Fixed::q_exp_negative({x.low}, q));
  }
  static Value exp_negative(Value x) {
    if (x.low < Fixed::kLeastExponential) OverflowLog::note("an exponential may reach its limit");
    return padded(Fixed::exp_negative(detail::value_of(x.high)).raw, Fixed::exp_negative(detail::value_of(x.low)).raw);
  }
  static Value exp_mean(Travel x) { return padded(Fixed::exp_mean({x.high}).raw, Fixed::exp_mean({x.low}).raw); }
  static Value gauss(const Scaled& x) {
    return padded(at(Fixed::gauss, x, most(x.signal)).raw, at(Fixed::gauss, x, least(x.signal)).raw);
  }
  static Value lorentzian(const Scaled& x) {
    return padded(at(Fixed::lorentzian, x, most(x.signal)).raw, at(Fixed::lorentzian, x, least(x.signal)).raw);
  }
  static Value reciprocal(Value x) {
    if (x.low < Fixed::kLeastDivisor) OverflowLog::note("a divisor may come too near to zero");
    return padded(Fixed::reciprocal(detail::value_of(x.high)).raw, Fixed::reciprocal(detail::value_of(x.low)).raw);
  }
  static Value pow_abs(const Scaled& x, Exponent e) {
    const auto end = [&](std::int64_t raw) {
      return std::int64_t{Checked::pow_abs(Checked::Scaled{x.gain, {{static_cast<std::int32_t>(raw)}}}, e).raw};
    };
    const std::int64_t a = end(least(x.signal)), b = end(most(x.signal));
    return a < b ? padded(a, b) : padded(b, a);
  }
  static Value pow_abs(State x, Exponent e) {
    const std::int64_t a = Checked::pow_abs(Checked::State{{least(x)}}, e).raw;
    const std::int64_t b = Checked::pow_abs(Checked::State{{most(x)}}, e).raw;
    return a < b ? padded(a, b) : padded(b, a);
  }
  // Between the least and the largest value that the positions reach.
  template <std::size_t Size>
  static Value table(const std::array<Value, Size>& values, std::int32_t points, const Scaled& x) {
    const auto index = [&](std::int64_t raw) {
      const fixed::Ratio at = Fixed::Scaled{x.gain, detail::value_of(raw)};
      return static_cast<std::int32_t>(limited<std::int64_t>(at.raw >> kRatioBits, 0, points - 1));
    };
    const std::int32_t a = index(x.signal.low), b = index(x.signal.high);
    const std::int32_t first = a < b ? a : b, last = a < b ? b : a;
    return hull_of(values, first, last + 1 < points ? last + 1 : last);
  }
  template <std::size_t Size>
  static Value table_over_turn(const std::array<Value, Size>& values, std::int32_t points, Angle) {
    return hull_of(values, 0, points - 1);
  }
  static Angle times_order(Angle angle, const Order&) { return angle; }
  static Sum wave(const Harmonic& h, Angle) { return Weight{{h.amplitude}} * padded(-one().high, one().high); }
  static Sum wave_times(const Harmonic& h, Angle, Value x) {
    return Weight{{h.amplitude}} * times(x, padded(-one().high, one().high));
  }
  static Wave sincos(Angle) {
    const Value whole = padded(-one().high, one().high);
    return {whole, whole};
  }

 private:
  static constexpr std::int64_t kOne = std::int64_t{1} << kStateBits;

  // A function of a ratio at one signal.
  template <class Function>
  static Fixed::Value at(Function&& function, const Scaled& x, std::int64_t raw) {
    return function(Fixed::Scaled{x.gain, detail::value_of(raw)});
  }
  template <std::size_t Size>
  static Value hull_of(const std::array<Value, Size>& values, std::int32_t first, std::int32_t last) {
    Value all = values[first];
    for (std::int32_t k = first + 1; k <= last; ++k) all = hull(all, values[k]);
    return all;
  }
  static Value exactly(Fixed::Value x) { return {x.raw, x.raw}; }
  static State clamped(State x, std::int64_t limit) {
    return {limited(x.low, -limit, limit), limited(x.high, -limit, limit)};
  }
  static State share(Fixed::State low, Fixed::State high) {
    constexpr std::int64_t kMargin = kOne >> 26;
    return {limited<std::int64_t>(low.raw - kMargin, 0, kOne), limited<std::int64_t>(high.raw + kMargin, 0, kOne)};
  }
  static Value padded(std::int64_t low, std::int64_t high) {
    constexpr std::int64_t kMargin = 4;
    return {low - kMargin, high + kMargin};
  }
  template <class... Rest>
  static constexpr std::int64_t smallest(std::int64_t first, Rest... rest) {
    ((first = rest < first ? rest : first), ...);
    return first;
  }
  template <class... Rest>
  static constexpr std::int64_t largest(std::int64_t first, Rest... rest) {
    ((first = rest > first ? rest : first), ...);
    return first;
  }
};

}  // namespace flexspline::fixed
