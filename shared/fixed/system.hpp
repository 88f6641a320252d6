// The number system of the drive, as shared/effects/README.md defines it: integers only. The policy says what happens
// where a result is safe by proof: `UncheckedArithmetic` takes it as it is, `CheckedArithmetic` (checked.hpp) checks
// it.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "shared/fixed/coefficients.hpp"
#include "shared/fixed/elementary.hpp"
#include "shared/fixed/types.hpp"
#include "shared/fixed/unchecked.hpp"
#include "shared/fixed/word.hpp"

namespace flexspline::fixed {

template <class Policy>
struct FixedSystem {
  using Parameter = double;
  // Values and states depend on the policy, as their sums may leave the range.
  struct Value : fixed::Value {
    friend constexpr bool operator==(Value, Value) = default;
    // Not by operator<=>, of which compilers keep the result as a number first.
    friend constexpr bool operator<(Value a, Value b) { return a.raw < b.raw; }
    friend constexpr bool operator>(Value a, Value b) { return a.raw > b.raw; }
    friend constexpr bool operator<=(Value a, Value b) { return a.raw <= b.raw; }
    friend constexpr bool operator>=(Value a, Value b) { return a.raw >= b.raw; }
    friend constexpr Value operator+(Value a, Value b) { return {{Policy::value(std::int64_t{a.raw} + b.raw)}}; }
    friend constexpr Value operator-(Value a, Value b) { return {{Policy::value(std::int64_t{a.raw} - b.raw)}}; }
    friend constexpr Value operator-(Value a) { return {{Policy::value(-std::int64_t{a.raw})}}; }
  };
  struct State : fixed::State {
    friend constexpr State operator+(State a, State b) { return {{Policy::state_sum(a.raw, b.raw)}}; }
    friend constexpr State operator-(State a, State b) { return {{Policy::state_difference(a.raw, b.raw)}}; }
    friend constexpr State operator-(State a) { return {{negated(a.raw)}}; }
  };
  // A term of a sum keeps its factors separate, so that a processor can multiply and add in one instruction.
  struct Weight : fixed::Weight {
    friend constexpr fixed::Sum operator*(Weight w, Value x) { return {long_product(w.raw, x.raw)}; }
  };
  struct Gain : fixed::Gain {
    friend constexpr fixed::Sum operator*(const Gain& g, Value x) {
      return {product(g, x.raw) >> (kProductBits - kSumBits)};
    }
  };
  struct Wave {
    Value cosine;
    Value sine;
  };
  // A signal over a characteristic size, not multiplied yet: each function needs another form of it.
  struct Scaled {
    fixed::RatioGain gain;
    Value signal;
    constexpr operator fixed::Ratio() const {
      const std::int32_t x = limited_to(signal.raw, gain.limit);
      return {shift_right(long_product(x, gain.mantissa), kMantissaBits + kValueBits - kRatioBits - gain.exponent)};
    }
  };
  // A decay factor exp(-x), stored as 1 - exp(-x) in Q63, so that it is exact for small x as well.
  struct DecayFactor {
    std::uint64_t lost = 0;
    constexpr operator State() const { return {{kOneState - static_cast<std::int64_t>(lost >> (63 - kStateBits))}}; }
  };
  // Magnitude of a step, 2^-32 turns.
  struct StepMagnitude {
    std::uint32_t raw;
  };
  // The travel of a step, not multiplied yet.
  struct StepTravel {
    std::uint32_t steps;
    std::uint32_t factor;
    std::uint32_t exponent_of_two;
    constexpr operator fixed::Travel() const { return {long_product(steps, factor)}; }
  };
  using Harmonic = fixed::Harmonic;
  using Angle = fixed::Angle;
  using Step = fixed::Step;
  using Sum = fixed::Sum;
  using Share = fixed::Share;
  using Travel = fixed::Travel;
  using Ratio = fixed::Ratio;
  using StepGain = fixed::StepGain;
  using RatioGain = fixed::RatioGain;
  using DistanceGain = fixed::DistanceGain;
  using Exponent = fixed::Exponent;
  using Order = fixed::Order;

  // Where exp_negative and reciprocal would leave the range of a value: -2.75 and 1/15.
  static constexpr std::int32_t kLeastExponential = -0x16000000;
  static constexpr std::int32_t kLeastDivisor = (std::int32_t{1} << kValueBits) / 15;

  // Coefficients, on the host; OverflowLog has what does not fit.
  static Weight weight(double x) { return {make_weight(x)}; }
  static Harmonic harmonic(double radians_per_turn, double cosine, double sine) {
    return make_harmonic(radians_per_turn, cosine, sine);
  }
  static Gain gain(double x) { return {make_gain(x)}; }
  static StepGain step_gain(double x) { return make_step_gain(x); }
  static RatioGain ratio_gain(double x) { return make_ratio_gain(x); }
  static DistanceGain distance_gain(double x) { return make_distance_gain(x); }
  static Value value(double x) { return {make_value(x)}; }
  static Share share(double x) { return make_share(x); }
  static Exponent exponent(double x) { return make_exponent(x); }
  static Order order(double radians_per_turn) { return make_order(radians_per_turn); }
  static double power(double x, double exponent) { return __builtin_pow(x, exponent); }

  // From here on integers only.
  static constexpr Value one() { return {{std::int32_t{1} << kValueBits}}; }
  static constexpr Value times(Value a, Value b) {
#if defined(__OPTIMIZE__)
    // Of signals that nothing modulates.
    if (__builtin_constant_p(b.raw) && b.raw == one().raw) return a;
#endif
    if constexpr (std::is_same_v<Policy, UncheckedArithmetic>)
      return {{as_word(static_cast<std::int32_t>(long_product(a.raw, b.raw) >> kValueBits))}};
    return {{Policy::value(long_product(a.raw, b.raw) >> kValueBits)}};
  }
  static constexpr Value scaled(const Gain& g, Value x) {
    constexpr int kDown = kProductBits - kValueBits;
    if constexpr (std::is_same_v<Policy, UncheckedArithmetic>) return {{rounded_shift<kDown>(product(g, x.raw))}};
    return {{Policy::value((product(g, x.raw) + (std::int64_t{1} << (kDown - 1))) >> kDown)}};
  }
  static constexpr Scaled ratio(const RatioGain& g, Value x) {
    return {g, x};
  }
  static constexpr Sum sum(Value x) {
    return {std::int64_t{x.raw} * (std::int64_t{1} << (kSumBits - kValueBits))};
  }
  // The sum of a balance: clamped to the range of a signal as the last step.
  static constexpr Value narrow(Sum x) {
    constexpr int kUp = kValueBits + 32 - kSumBits;
    const auto high = static_cast<std::int32_t>(x.raw >> 32);
    constexpr std::int32_t kMost = std::int32_t{1} << (31 - kUp);
    const auto word = static_cast<std::int32_t>(static_cast<std::uint64_t>(x.raw) >> (32 - kUp));
    return {{high >= -kMost + 1 && high < kMost ? word : high < 0 ? -0x7FFFFFFF : 0x7FFFFFFF}};
  }
  // Both have the same binary point.
  static constexpr Value narrow(State x) {
    static_assert(kStateBits - kValueBits == 32);
    const auto high = static_cast<std::uint32_t>(x.raw >> 32);
    return {{as_word(static_cast<std::int32_t>(high + (static_cast<std::uint32_t>(x.raw) >> 31)))}};
  }
  static constexpr State widen(Value x) {
    return {{std::int64_t{x.raw} * (std::int64_t{1} << 32)}};
  }

  // More than half a turn counts as a turn.
  static constexpr StepMagnitude magnitude(Step x) {
    const auto low = static_cast<std::int32_t>(x.raw), high = static_cast<std::int32_t>(x.raw >> 32);
    return {high == low >> 31 ? magnitude_of(low) : 0xFFFFFFFF};
  }
  static constexpr Value magnitude(Value x) {
    Policy::expect(x.raw != INT32_MIN, "a value leaves its range");
    return {{as_word(static_cast<std::int32_t>(magnitude_of(x.raw)))}};
  }
  static constexpr State magnitude(State x) {
    return x.raw < 0 ? -x : x;
  }
  static constexpr Value clamp(Value x, Value limit) {
    Policy::expect(limit.raw != INT32_MIN, "a value leaves its range");
    return {{limited_to(x.raw, limit.raw)}};
  }
  // The limit has no lower word: the upper one decides.
  static constexpr State clamp(State x, Value limit) {
    const auto high = static_cast<std::int32_t>(x.raw >> 32);
    if (high >= limit.raw) return widen(limit);
    if (high < -limit.raw) return widen({{-limit.raw}});
    return x;
  }
  static constexpr State clamp(State x, State limit) {
    return {{limited_to(x.raw, limit.raw)}};
  }
  static constexpr Value between(Value x, Value low, Value high) {
    return {{limited(x.raw, low.raw, high.raw)}};
  }
  static constexpr State clamp_to_one(State x) {
    return {{limited_to(x.raw, kOneState)}};
  }
  static constexpr State bounded(State x) {
    return {{limited_to(x.raw, 4 * kOneState)}};
  }
  static constexpr Value by_sign(Value x, Value a, Value b) {
    return x.raw < 0 ? b : a;
  }
  static constexpr State sign(Step x) {
    const auto high = static_cast<std::int32_t>(x.raw >> 32);
    const std::int32_t one = (high >> 31 | 1) * (std::int32_t{1} << kValueBits);
    return widen({{as_word((high | static_cast<std::int32_t>(x.raw)) != 0 ? one : 0)}});
  }
  static constexpr State sign(Value x) {
    return {{x.raw > 0 ? kOneState : x.raw < 0 ? -kOneState : 0}};
  }

  // Limited to two, like every signal at entry: so the bound of a linear observer holds for any input.
  static constexpr State signal(const StepGain& g, Step x) {
    const std::uint32_t size = magnitude(x).raw;
    const std::uint64_t travelled = long_product((size < g.near ? size : g.near) << g.up, g.factor);
    const auto sign =
        static_cast<std::uint64_t>(x.raw >> 63) ^ static_cast<std::uint64_t>(std::int64_t{g.mantissa} >> 63);
    return {{static_cast<std::int64_t>(((travelled << (kStateBits - kTravelBits)) ^ sign) - sign)}};
  }
  // Within four: see DistanceGain.
  static constexpr State signal(const DistanceGain& g, Step x) {
    const std::int64_t distance = limited_to(x.raw, g.limit);
    const auto low = static_cast<std::uint32_t>(distance), high = static_cast<std::uint32_t>(distance >> 32);
    // It fits a word, so that the upper word gives the bits that the lower one lacks.
    const auto down = static_cast<std::uint32_t>(std::int32_t{g.down});
    const std::uint32_t word = g.down >= 0 ? shift_down(low, down) | shift_up(high, 32 - down) : low << (0 - down);
    return {{long_product(static_cast<std::int32_t>(word), g.factor)}};
  }
  // Up to 16 turns; the gain is in turns per base.
  static constexpr Step distance(const Gain& g, Value x) {
    return {product(g, x.raw) >> (kProductBits - kAngleBits)};
  }
  static constexpr StepTravel travel(const StepGain& g, StepMagnitude x) {
    const auto most = static_cast<std::uint32_t>(g.limit);
    return {(x.raw < most ? x.raw : most) << g.up, g.factor, g.exponent_of_two};
  }
  static constexpr Travel travel(const Gain& g, Value x) {
    const std::int64_t travelled = product(g, x.raw);
    return {static_cast<std::uint64_t>(travelled < 0 ? 0 : travelled) << (kTravelBits - kProductBits)};
  }
  static constexpr Travel times(Travel t, Value x) {
    return by_mantissa(t, static_cast<std::uint32_t>(x.raw < 0 ? 0 : x.raw), kValueBits);
  }
  static constexpr Travel over(Travel t, Value x) {
    if (t.raw == 0) return t;
    if (x.raw <= 0) return {kLargestTravel};
    const Reciprocal r = reciprocal_of(static_cast<std::uint64_t>(x.raw));
    return by_mantissa(t, r.mantissa, kMantissaBits - kValueBits - r.exponent);
  }
  static constexpr Travel times_power(Travel t, State x, Exponent e) {
    if (e.raw == 0 || t.raw == 0) return t;
    if (x.raw == 0) return e.raw > 0 ? Travel{} : Travel{kLargestTravel};
    const Power p = power_of_two_of(log_times(size_of(x.raw), kStateBits, e));
    return by_mantissa(t, p.mantissa, kMantissaBits - p.exponent);
  }
  // By how much a step moves a state: at most four, as the state is clamped to one next.
  static constexpr State step(Travel t, Value x) {
    constexpr std::uint64_t kFour = std::uint64_t{4} << kStateBits;
    const auto factor = static_cast<std::uint64_t>(size_of(x.raw));
    const Product p = multiply(t.raw, factor);
    constexpr int kBits = kTravelBits + kValueBits - kStateBits;
    const std::uint64_t size = (p.high >> (kBits - 1)) != 0 ? kFour : (p.high << (64 - kBits)) | (p.low >> kBits);
    return {{with_sign(size > kFour ? kFour : size, x.raw < 0)}};
  }
  static constexpr State times(State a, Value b) {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 63;
#if defined(__OPTIMIZE__)
    // Of a value that was widened: one product, which is exact.
    if (__builtin_constant_p(static_cast<std::uint32_t>(a.raw)) && static_cast<std::uint32_t>(a.raw) == 0) {
      const std::int64_t exact = long_product(as_word(static_cast<std::int32_t>(a.raw >> 32)), b.raw);
      constexpr std::int64_t kFits = (std::int64_t{1} << 58) - 1;
      if (limited_to(exact, kFits) == exact) [[likely]]
        return {{exact * 32}};
    }
#endif
    const Product p = multiply(size_of(a.raw), magnitude_of(b.raw));
    const bool fits = (p.high >> (kValueBits - 1)) == 0;
    Policy::expect(fits, "a product of a state leaves its range");
    const std::uint64_t size = (p.high << (64 - kValueBits)) | (p.low >> kValueBits);
    return {{with_sign(fits ? size : kMost - 1, (a.raw < 0) != (b.raw < 0))}};
  }
  // Rounded down, to two units. The product of both lower words is below that and left out.
  static constexpr State times(State a, const Share& b) {
    const std::int32_t high = as_word(static_cast<std::int32_t>(a.raw >> 32));
    // A share of one does not fit a signed word and is the nearest number below.
    const auto whole = static_cast<std::int32_t>(b.raw >> 32);
    const std::int32_t rest = as_word(static_cast<std::int32_t>(static_cast<std::uint32_t>(b.raw) >> 1));
    const std::int64_t lower = (long_product(high, rest) >> 31) +
                               multiply_high(static_cast<std::uint32_t>(a.raw), static_cast<std::uint32_t>(whole));
    return {{(long_product(high, whole) + lower) * 2}};
  }
  // With the upper word of the share only: for an observer's gain, for which a resolution of 2^-31 is enough.
  static constexpr State times_gain(State a, const Share& b) {
    const std::int32_t high = as_word(static_cast<std::int32_t>(a.raw >> 32));
    const auto whole = static_cast<std::int32_t>(b.raw >> 32);
    return {{(long_product(high, whole) +
              multiply_high(static_cast<std::uint32_t>(a.raw), static_cast<std::uint32_t>(whole))) *
             2}};
  }
  // Reduces the distance, of which 28 fractional bits are used: so it may pass the target by a unit.
  static constexpr State relax(State from, State target, DecayFactor factor) {
    const std::int64_t away = Policy::state_difference(from.raw, target.raw);
    Policy::expect(away < 8 * kOneState && away >= -8 * kOneState, "a distance to relax over leaves its range");
    const std::int32_t distance = as_word(static_cast<std::int32_t>(away >> 31));
    const auto low = static_cast<std::int32_t>(factor.lost);
    // The lower word is signed, as the distance is.
    const std::int32_t high = as_word(static_cast<std::int32_t>((factor.lost >> 32) + (low < 0 ? 1 : 0)));
    const std::int64_t change = long_product(distance, high) + (long_product(distance, low) >> 32);
    return {{static_cast<std::int64_t>(static_cast<std::uint64_t>(from.raw) - static_cast<std::uint64_t>(change))}};
  }
  // With a decay factor from another function than an exponential.
  static constexpr State relax(State from, State target, State share) {
    const std::uint64_t lost = static_cast<std::uint64_t>(kOneState - share.raw) << (63 - kStateBits);
    return relax(from, target, DecayFactor{lost < kAllLost ? lost : kAllLost});
  }

  static constexpr DecayFactor exp_negative(const StepTravel& x) {
    return {one_minus_power_of_two(long_product(x.steps, x.exponent_of_two))};
  }
  static constexpr DecayFactor exp_negative(Travel x) {
    return {one_minus_exp(x.raw)};
  }
  static constexpr Value exp_negative(Value x) {
    constexpr std::int64_t kPerLn2 = 0x5C551D94AE0BF85E;  // Q62
    const std::int64_t y =
        -multiply_round(x.raw < kLeastExponential ? kLeastExponential : x.raw, kPerLn2, 62 + kValueBits - kLogBits);
    return from_power(power_of_two_of(y));
  }
  static constexpr Value exp_mean(Travel x) {
    const SplitTravel split = split_travel(x.raw);
    if (split.count == 0) {
      const auto mean = decay_mean(static_cast<std::int32_t>(split.rest >> (kTravelBits - 31)));
      return {{static_cast<std::int32_t>(shift_right(mean, kMantissaBits - kValueBits))}};
    }
    constexpr int kLostBits = 52;  // so that the shift below is less than a word
    const std::uint64_t lost = ((std::uint64_t{1} << 60) - decay(x.raw)) >> (60 - kLostBits);
    const Reciprocal r = reciprocal_of(x.raw);
    return {{static_cast<std::int32_t>(
        multiply_down(lost, r.mantissa, kLostBits + kMantissaBits - kValueBits - kTravelBits - r.exponent))}};
  }
  // exp(-y), y = log(1 + z)/(q - 1), z = (q - 1) x.
  static constexpr DecayFactor q_exp_negative(Travel x, Exponent q) {
    constexpr int kZBits = 52;
    const std::int64_t less_one = std::int64_t{q.raw} - (std::int64_t{1} << kExponentBits);
    const std::int64_t z =
        multiply_round(static_cast<std::int64_t>(x.raw), less_one, kTravelBits + kExponentBits - kZBits);
    constexpr std::int64_t kSmall = std::int64_t{1} << (kZBits - 4);
    if (z < kSmall && z > -kSmall) {
      // The square of a small z is far below a unit, but z itself is rounded, so x is used instead of z.
      const auto mean = static_cast<std::uint32_t>(log_mean(static_cast<std::int32_t>(shift_right(z, kZBits - 31))));
      return exp_negative(by_mantissa(x, mean, kMantissaBits));
    }
    const std::int64_t base = (std::int64_t{1} << kZBits) + z;
    if (base <= 0) return {kAllLost};
    const std::int64_t log = log2_of(static_cast<std::uint64_t>(base)) - (std::int64_t{kZBits} << kLogBits);
    const std::uint64_t natural = multiply_down(size_of(log), kLn2, kTravelBits - (50 - kLogBits));  // Q50
    const Reciprocal r = reciprocal_of(size_of(less_one));
    return exp_negative(
        by_mantissa({natural}, r.mantissa, kMantissaBits - r.exponent - kExponentBits - (kTravelBits - 50)));
  }
  static constexpr Value gauss(const Scaled& x) {
    const std::uint32_t size = magnitude_of(x.signal.raw);
    // The ratio times the root of log2(e), Q28, below 5.3; its square Q27.
    const std::uint32_t w = multiply_high((size < x.gain.near ? size : x.gain.near) << x.gain.up, x.gain.bell);
    const auto square = static_cast<std::uint32_t>(long_product(w, w) >> 29);
    constexpr std::uint32_t kRounding = (std::uint32_t{1} << 26) + (std::uint32_t{kMantissaBits - kValueBits} << 27);
    const std::uint32_t down = (square + kRounding) >> 27;
    const std::int32_t power = power_of_two_word(static_cast<std::int32_t>(0 - (square << 5)));
    return {{power >> down}};
  }
  static constexpr Value lorentzian(Ratio x) {
    constexpr std::int64_t kAllGone = std::int64_t{11000} << kRatioBits;  // one over its square is one unit
    constexpr int kBits = 36;
    const std::int64_t size = limited<std::int64_t>(x.raw, -kAllGone, kAllGone);
    const auto square = static_cast<std::uint64_t>(multiply_round(size, size, 2 * kRatioBits - kBits));
    const Reciprocal r = reciprocal_of((std::uint64_t{1} << kBits) + square);
    return {{static_cast<std::int32_t>(shift_right(r.mantissa, kMantissaBits - kValueBits - kBits - r.exponent))}};
  }
  static constexpr Value reciprocal(Value x) {
    const Reciprocal r = reciprocal_of(static_cast<std::uint64_t>(x.raw < kLeastDivisor ? kLeastDivisor : x.raw));
    return {{static_cast<std::int32_t>(shift_right(r.mantissa, kMantissaBits - 2 * kValueBits - r.exponent))}};
  }
  // For exponents above zero; results below 11.
  static constexpr Value pow_abs(const Scaled& x, Exponent e) {
    const std::uint32_t size = magnitude_of(x.signal.raw);
    const auto zeros = static_cast<std::uint32_t>(std::countl_zero(size));
    return power_of(log_sum(static_cast<std::uint32_t>(x.gain.log) - (zeros << 25), shift_up(size, zeros)), e,
                    size == 0);
  }
  static constexpr Value pow_abs(State x, Exponent e) {
    if (e.raw == 0) return one();
    const std::uint64_t size = size_of(x.raw);
    const auto zeros = static_cast<std::uint32_t>(std::countl_zero(size)) & 63;
    const auto mantissa = static_cast<std::uint32_t>((size << zeros) >> 32);
    return power_of(log_sum((63 - kStateBits - zeros) << 25, mantissa), e, size == 0);
  }
  // From amplitude and phase: one sine. Whole turns count as well where the order is not an integer.
  static constexpr Value wave_of(const Harmonic& h, Angle angle) {
    const auto turns = static_cast<std::int32_t>(angle.raw >> 32);
    const auto part = static_cast<std::uint32_t>(angle.raw);
    // In this order two instructions multiply and add.
    auto phase = static_cast<std::uint32_t>(
        as_word(static_cast<std::int32_t>(h.phase + part * static_cast<std::uint32_t>(h.whole))));
    phase += static_cast<std::uint32_t>(turns) * h.fraction;
    phase += multiply_high(part, h.fraction);
    return {{sine_word(static_cast<std::uint32_t>(add_high(static_cast<std::int32_t>(phase), turns, h.remainder)))}};
  }
  static constexpr Sum wave(const Harmonic& h, Angle angle) {
    return Weight{{h.amplitude}} * wave_of(h, angle);
  }
  static constexpr Sum wave_times(const Harmonic& h, Angle angle, Value x) {
    return Weight{{h.amplitude}} * times(x, wave_of(h, angle));
  }

  static constexpr Angle times_order(Angle angle, Order order) {
    Product p = multiply(static_cast<std::uint64_t>(angle.raw), static_cast<std::uint64_t>(order.raw));
    if (angle.raw < 0) p.high -= static_cast<std::uint64_t>(order.raw);
    return {static_cast<std::int64_t>((p.high << (64 - kOrderBits)) | (p.low >> kOrderBits))};
  }
  static constexpr Wave sincos(Angle phase) {
    const SineCosine w = sine_cosine(static_cast<std::uint32_t>(static_cast<std::uint64_t>(phase.raw)));
    constexpr int kBits = kMantissaBits - kValueBits;
    return {{{static_cast<std::int32_t>(shift_right(w.cosine, kBits))}},
            {{static_cast<std::int32_t>(shift_right(w.sine, kBits))}}};
  }
  // Linear interpolation between `points` values: at a position counted in points from the first, constant beyond both
  // ends; and at a phase, where the whole table is a turn. Exact to half a unit, and to 2^-30 of the difference between
  // two points.
  template <std::size_t Size>
  static constexpr Value table(const std::array<Value, Size>& values, std::int32_t points, Ratio at) {
    if (at.raw <= 0 || points < 2) return values[0];
    const std::int64_t index = at.raw >> kRatioBits;
    if (index >= points - 1) return values[points - 1];
    const std::int64_t rest = at.raw & ((std::int64_t{1} << kRatioBits) - 1);
    return on_line(values[index], values[index + 1], rest >> (kRatioBits - kLineBits));
  }
  template <std::size_t Size>
  static constexpr Value table_over_turn(const std::array<Value, Size>& values, std::int32_t points, Angle phase) {
    const std::uint64_t at = (static_cast<std::uint64_t>(phase.raw) & 0xFFFFFFFF) * static_cast<std::uint64_t>(points);
    const auto index = static_cast<std::int32_t>(at >> kAngleBits);
    const auto rest = static_cast<std::int64_t>((at & 0xFFFFFFFF) >> (kAngleBits - kLineBits));
    return on_line(values[index], values[index + 1 < points ? index + 1 : 0], rest);
  }

  // From integers in 2^-32: a position and a distance in turns, a value below 15, the wave at a phase in turns.
  static constexpr Angle angle(std::int64_t q32) {
    return {q32};
  }
  static constexpr Step steps(std::int64_t q32) {
    return {q32};
  }
  static constexpr Value value_of(std::int64_t q32) {
    return {{Policy::value(shift_right(q32, kAngleBits - kValueBits))}};
  }
  static constexpr Wave wave(std::uint32_t q32) {
    return sincos({static_cast<std::int64_t>(q32)});
  }

 private:
  static constexpr int kLineBits = 30;
  static constexpr Value on_line(Value a, Value b, std::int64_t share) {
    return {{static_cast<std::int32_t>(a.raw + shift_right((std::int64_t{b.raw} - a.raw) * share, kLineBits))}};
  }

  static constexpr std::int64_t kOneState = std::int64_t{1} << kStateBits;
  static constexpr std::uint64_t kLargest = 0x7FFFFFFFFFFFFFFF;

  // t m 2^-bits, limited; bits may be anything.
  static constexpr Travel by_mantissa(Travel t, std::uint32_t m, int bits) {
    const Product p = multiply(t.raw, m);  // below 2^95
    if (bits >= 96) return {};
    if (bits >= 64) return {p.high >> (bits - 64)};
    if (bits <= 0) {
      const int up = -bits;
      if (p.high != 0 || up >= 63 || p.low > (kLargestTravel >> up))
        return {p.low == 0 && p.high == 0 ? 0 : kLargestTravel};
      return {p.low << up};
    }
    if ((p.high >> (bits - 1)) != 0) return {kLargestTravel};
    const std::uint64_t size = (p.high << (64 - bits)) | (p.low >> bits);
    return {size > kLargestTravel ? kLargestTravel : size};
  }
  // e log2(x 2^-bits), Q40, limited to the input range of a power of two.
  static constexpr std::int64_t log_times(std::uint64_t x, int bits, Exponent e) {
    const std::int64_t log = log2_of(x) - (std::int64_t{bits} << kLogBits);
    return multiply_round(log, e.raw, kExponentBits);
  }
  // Wraps for gains that are not valid for any signal.
  static constexpr std::int32_t log_sum(std::uint32_t whole, std::uint32_t mantissa) {
    return static_cast<std::int32_t>(whole + static_cast<std::uint32_t>(log2_of_mantissa(mantissa)));
  }
  // 2^(e log), log in Q25; the power is counted from 2^-28, below which a value is zero.
  static constexpr Value power_of(std::int32_t log, Exponent e, bool of_zero) {
    constexpr int kBits = 25 + kExponentBits - 32;
    constexpr std::int32_t kLow = std::int32_t{28} << kBits;
    const std::int64_t product = long_product(log, e.raw);
    const auto high = static_cast<std::int32_t>(product >> 32) + kLow;
    const std::uint32_t counted = saturated<kBits + 5>(of_zero ? 0 : high);
    const std::uint32_t y = (counted << (26 - kBits)) | (static_cast<std::uint32_t>(product) >> (32 - (26 - kBits)));
    const std::uint32_t shift = 31 - ((y + (std::uint32_t{1} << 25)) >> 26);
    Policy::expect(shift < 32, "a power leaves the range of a value");
    return {{power_of_two_word(static_cast<std::int32_t>(y << 6)) >> (shift & 31)}};
  }
  static constexpr Value from_power(Power p) {
    Policy::expect(p.exponent < 4, "a power leaves the range of a value");
    if (p.exponent >= 4) return {{0x7FFFFFFF}};
    return {{static_cast<std::int32_t>(shift_right(p.mantissa, kMantissaBits - kValueBits - p.exponent))}};
  }
};

using Fixed = FixedSystem<UncheckedArithmetic>;

}  // namespace flexspline::fixed
