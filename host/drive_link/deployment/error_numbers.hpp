// A number system that bounds how far the drive's arithmetic is from the equations: each number is the range of what
// the equation gives, and a bound of what the drive's number differs from it. One run of an effect over it bounds its
// error for every input. PROOF.md has each rule and why it holds.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "shared/fixed/coefficients.hpp"
#include "shared/fixed/types.hpp"

namespace flexspline::deployment {

// Why an error has no bound, first reason first.
class ProofFailure {
 public:
  static void clear() { reason_.clear(); }
  static void note(const char* reason) {
    if (reason_.empty()) reason_ = reason;
  }
  static const std::string& reason() { return reason_; }

 private:
  static thread_local std::string reason_;
};

struct ErrorNumbers {
  // Of a value, a state, a sum of torques and an angle, as shared/fixed/README.md states them.
  static constexpr double kUnit = 0x1p-27;
  static constexpr double kStateUnit = 0x1p-59;
  static constexpr double kPhaseUnit = 0x1p-32;
  static constexpr double kTurn = 6.283185307179586;

  using Parameter = double;

  template <class Format>
  struct Bounded {
    double low = 0.0, high = 0.0;  // of the equation
    double error = 0.0;            // the drive's number is at most this far from it, at the same instant
    int signal = 0;  // the input that it is, but for constants: from tick to tick both change by the same amount
    bool constant = false;

    double most() const { return std::max(high, -low); }
    double least() const { return low > 0.0 ? low : high < 0.0 ? -high : 0.0; }
    friend Bounded operator-(const Bounded& x) { return {-x.high, -x.low, x.error}; }
    friend Bounded operator+(const Bounded& a, const Bounded& b) {
      const int of = a.constant ? b.signal : b.constant ? a.signal : 0;
      return {a.low + b.low, a.high + b.high, a.error + b.error, of, a.constant && b.constant};
    }
    // One signal at two ticks: what it is off by is the same in both.
    friend Bounded operator-(const Bounded& a, const Bounded& b) {
      if (a.signal != 0 && a.signal == b.signal) return {a.low - b.high, a.high - b.low, 0.0};
      Bounded difference = a + -b;
      if (b.constant) difference.signal = a.signal;
      return difference;
    }
    friend Bounded& operator+=(Bounded& a, const Bounded& b) { return a = a + b; }
    friend bool operator==(const Bounded&, const Bounded&) = default;
  };
  struct OfValue;
  struct OfState;
  struct OfSum;
  using Value = Bounded<OfValue>;
  using State = Bounded<OfState>;
  using Sum = Bounded<OfSum>;

  // A position: how many turns from zero, how far a tick can move it, and of a phase what it is off by, in turns.
  struct Step {
    double most_turns = 0.0;
  };
  struct Angle {
    double most_turns = 0.0;
    double step_turns = 0.0;
    double error_turns = 0.0;
    friend Step operator-(const Angle& a, const Angle&) { return {a.step_turns}; }
  };

  // A coefficient as stated, and how far the drive's is from it.
  struct Weight {
    double exact = 0.0;
    double error = 0.0;
    friend Sum operator*(const Weight& w, const Value& x) { return scaled_to<OfSum>(w.exact, w.error, x); }
  };
  struct Gain {
    double exact = 0.0;
    double relative = 0.0;
    friend Sum operator*(const Gain& g, const Value& x) {
      Sum sum = scaled_to<OfSum>(g.exact, std::abs(g.exact) * g.relative, x);
      sum.error += 0x1p-54;
      return sum;
    }
  };
  struct StepGain {
    double exact = 0.0;
    double relative = 0.0;
    double limit_turns = 0.0;  // longer steps count as this
  };
  struct RatioGain {
    double exact = 0.0;
    double relative = 0.0;   // of the number itself
    double bell = 0.0;       // of its root of log2(e)
    double logarithm = 0.0;  // of its logarithm to the base of two, absolute
  };
  struct Scaled {
    RatioGain gain;
    Value signal;
  };
  using Ratio = Scaled;
  struct Exponent {
    double exact = 0.0;
    double error = 0.0;
  };
  struct Order {
    double cycles = 0.0;  // a turn
    double error = 0.0;
  };
  struct Harmonic {
    Order order;
    double amplitude = 0.0;
    double error = 0.0;
  };
  struct Wave {
    Value cosine;
    Value sine;
  };
  // A distance over a length. `relative` bounds what it is off by as a share of itself, however small it is; `least` is
  // the shortest one that is not zero.
  struct Travel {
    double low = 0.0, high = 0.0;
    double relative = 0.0;
    double least = 0.0;
    double ended = 0.0;     // what would still be left of a distance where travels end on a drive
    bool of_state = false;  // multiplied by a power of what is left to the limit of the state that it moves
    double extra = 0.0;     // what that power is off by, as a share, times what is left
    double rounding = 0.0;  // and what rounding it adds, of the state itself
  };
  // What a relaxation keeps, by what it loses, with the same meanings.
  struct DecayFactor {
    double least_lost = 0.0, most_lost = 1.0;
    Travel travel;
    double exponent = 1.0;
  };

  static Weight weight(double x) { return {x, std::abs(real(fixed::make_weight(x).raw, fixed::kValueBits) - x)}; }
  static Gain gain(double x) { return {x, relative(fixed::make_gain(x).factor, x)}; }
  static StepGain step_gain(double x) {
    const fixed::StepGain g = fixed::make_step_gain(x);
    return {x, std::max(relative(g.factor, x), relative(g.exponent_of_two, x * 1.4426950408889634)),
            real(g.limit, fixed::kAngleBits)};
  }
  static RatioGain ratio_gain(double x) {
    const fixed::RatioGain g = fixed::make_ratio_gain(x);
    const double whole = real(g.log, 25) - std::log2(std::abs(x));
    return {x, relative(g.mantissa, x), relative(g.bell, x * 1.2011224087864498),
            x == 0.0 ? 0.0 : std::abs(whole - std::round(whole))};
  }
  static Value value(double x) {
    return {x, x, std::abs(real(fixed::make_value(x).raw, fixed::kValueBits) - x), 0, true};
  }
  static Exponent exponent(double x) {
    return {x, std::abs(real(fixed::make_exponent(x).raw, fixed::kExponentBits) - x)};
  }
  static Order order(double radians_per_turn) {
    const double cycles = radians_per_turn / kTurn;
    return {cycles, std::abs(real(fixed::make_order(radians_per_turn).raw, fixed::kOrderBits) - cycles)};
  }
  static Harmonic harmonic(double radians_per_turn, double cosine, double sine) {
    const double amplitude = std::hypot(cosine, sine);
    return {order(radians_per_turn), amplitude, weight(amplitude).error};
  }
  static double power(double x, double exponent) { return std::pow(x, exponent); }

  static Value one() { return {1.0, 1.0, 0.0, 0, true}; }
  static Value times(const Value& a, const Value& b) {
    if (b == one()) return a;
    return product<OfValue>(a, b, kUnit);
  }
  static State times(const State& a, const Value& b) { return product<OfState>(a, b, kStateUnit); }
  static Value scaled(const Gain& g, const Value& x) {
    Value result = scaled_to<OfValue>(g.exact, std::abs(g.exact) * g.relative, x);
    result.error += 0.5 * kUnit;
    return result;
  }
  static Scaled ratio(const RatioGain& g, const Value& x) { return {g, x}; }
  static Sum sum(const Value& x) { return {x.low, x.high, x.error}; }
  static Value narrow(const State& x) { return {x.low, x.high, x.error + 0.5 * kUnit}; }
  static State widen(const Value& x) { return {x.low, x.high, x.error}; }

  static Step magnitude(const Step& x) { return x; }
  template <class F>
  static Bounded<F> magnitude(const Bounded<F>& x) {
    return {x.least(), x.most(), x.error};
  }
  template <class F>
  static Bounded<F> clamp(const Bounded<F>& x, const Value& limit) {
    return {std::clamp(x.low, -limit.high, limit.high), std::clamp(x.high, -limit.high, limit.high),
            std::max(x.error, limit.error)};
  }
  static Value between(const Value& x, const Value& low, const Value& high) {
    return {std::min(std::max(x.low, low.low), high.low), std::min(std::max(x.high, low.high), high.high),
            std::max({x.error, low.error, high.error})};
  }
  static State clamp_to_one(const State& x) { return within(x, 1.0); }
  static State bounded(const State& x) { return within(x, 4.0); }
  static Value by_sign(const Value& x, const Value& a, const Value& b) {
    if (x.error > 0.0 && x.low < 0.0 && x.high >= 0.0)
      ProofFailure::note("what it does hangs on the sign of a number that is rounded");
    return {std::min(a.low, b.low), std::max(a.high, b.high), std::max(a.error, b.error)};
  }
  static State sign(const Step&) { return {-1.0, 1.0, 0.0}; }
  static State sign(const Value& x) {
    exact_motion(x);
    return {x.low > 0.0 ? 1.0 : x.low < 0.0 ? -1.0 : 0.0, x.high > 0.0 ? 1.0 : x.high < 0.0 ? -1.0 : 0.0, 0.0};
  }

  static Travel travel(const StepGain& g, const Step& x) {
    Travel t;
    t.high = g.exact * x.most_turns;
    t.least = g.exact * kPhaseUnit;
    t.relative = g.relative;
    if (x.most_turns > g.limit_turns) t.ended = std::exp(-g.exact * g.limit_turns);
    return t;
  }
  static Travel travel(const Gain& g, const Value& x) {
    exact_motion(x);
    Travel t;
    t.low = g.exact * x.low;
    t.high = g.exact * x.high;
    t.least = t.low > 0.0 ? t.low : g.exact * kUnit;
    t.relative = g.relative;
    // Gains stop below 16.
    if (t.high > 15.9) t.ended = std::exp(-15.9);
    return t;
  }
  // By what is left of the state that it moves, whose own error does not count (PROOF.md, laws that slow down).
  static Travel times(Travel t, const Value& left) {
    of_state(t, left.high, 1.0);
    t.extra += 0.5 * kUnit;
    return t;
  }
  static Travel times_power(Travel t, const State& left, const Exponent& e) {
    if (e.exact < 0.0)
      ProofFailure::note("where its limit is near it moves ever faster, which spreads what is rounded without a bound");
    of_state(t, left.high, e.exact);
    t.relative += 5e-9 + e.error * (2.0 + std::log(2.0));
    t.extra += 1.4 * e.error;
    return t;
  }
  static Travel over(Travel t, const Value& x) {
    const double least = x.low - x.error;
    if (!(least > 0.0)) {
      ProofFailure::note("it divides by a torque that may be zero");
      return t;
    }
    t.high /= x.low;
    t.low /= x.high;
    t.least /= x.high;
    t.relative += x.error / least + 3.0 * 0x1p-30 + 0x1p-58 / t.least;
    if (t.high > 15.9) t.ended = std::max(t.ended, std::exp(-15.9));
    return t;
  }
  static State step(const Travel&, const Value& x) {
    ProofFailure::note("its state is moved by a rate of its own");
    return {-4.0, 4.0, x.error};
  }

  static DecayFactor exp_negative(const Travel& t) {
    DecayFactor k;
    k.least_lost = -std::expm1(-t.low);
    k.most_lost = -std::expm1(-t.high);
    k.travel = t;
    k.travel.relative += 2.1e-8;
    return k;
  }
  static DecayFactor q_exp_negative(const Travel& t, const Exponent& q) {
    if (q.exact < 1.0)
      ProofFailure::note(
          "its exponent is below one: near its limit it moves ever faster, which spreads what is rounded without a "
          "bound");
    DecayFactor k = exp_negative(t);
    k.travel.relative += q.error;
    k.exponent = q.exact;
    k.least_lost = 0.0;
    return k;
  }
  static State relax(const State& from, const State& target, const DecayFactor& kept) {
    const Travel& t = kept.travel;
    const double away = std::max(from.high - target.low, target.high - from.low) + from.error + target.error;
    State to{std::min(from.low, target.low), std::max(from.high, target.high)};
    // Of what is lost: the share, the distance of 28 bits, and the target.
    const double lost = away * (t.relative + 2.0 * t.ended) + t.extra + 0x1p-28 + target.error;
    if (kept.least_lost > 0.0) {
      to.error = (1.0 - kept.least_lost) * from.error + kept.most_lost * lost + kStateUnit;
    } else {
      to.error = std::max(from.error, lost + roundings_of(kept));
    }
    return to;
  }

  static Value exp_mean(const Travel& t) {
    const auto mean = [](double x) { return x > 1e-6 ? -std::expm1(-x) / x : 1.0 - 0.5 * x; };
    return {mean(t.high), mean(t.low), 1.5 * kUnit + 0.3 * t.relative};
  }
  static Value exp_negative(const Value& x) {
    const double most = std::exp(-(x.low - x.error));
    return {std::exp(-x.high), std::exp(-x.low), 0.5 * kUnit + 4.5e-9 * most + most * x.error};
  }
  static Value reciprocal(const Value& x) {
    const double least = x.low - x.error;
    if (!(least > 1.0 / 15.0)) {
      ProofFailure::note("it divides by a number that may be zero");
      return {0.0, 15.0, 15.0};
    }
    return {1.0 / x.high, 1.0 / x.low, 0.5 * kUnit + 4.5e-9 / least + x.error / (least * least)};
  }
  static Value gauss(const Scaled& x) {
    const double least = std::abs(x.gain.exact) * x.signal.least(), most = std::abs(x.gain.exact) * x.signal.most();
    // 2 r^2 exp(-r^2) is at most 2/e, the slope 0.86.
    return {std::exp(-most * most), std::exp(-least * least),
            2.2 * kUnit + 0.74 * x.gain.bell + 0.86 * std::abs(x.gain.exact) * x.signal.error};
  }
  static Value lorentzian(const Scaled& x) {
    const double least = std::abs(x.gain.exact) * x.signal.least(), most = std::abs(x.gain.exact) * x.signal.most();
    return {1.0 / (1.0 + most * most), 1.0 / (1.0 + least * least),
            1.4 * kUnit + 0.5 * x.gain.relative + 0.65 * std::abs(x.gain.exact) * x.signal.error};
  }
  static Value pow_abs(const Scaled& x, const Exponent& e) {
    const double size = std::abs(x.gain.exact);
    const double most = size * x.signal.most() + size * x.signal.error;
    const double power = std::pow(most, e.exact);
    // y^e ln y is -1/(e exp(1)) at its least, between zero and one.
    const double by_exponent = std::max(power * std::abs(std::log(std::max(most, 1e-300))), 0.37 / e.exact);
    const double by_input = x.signal.error == 0.0 ? 0.0
                            : e.exact >= 1.0      ? e.exact * std::pow(most, e.exact - 1.0) * size * x.signal.error
                                                  : std::pow(size * x.signal.error, e.exact);
    return {
        std::pow(size * x.signal.least(), e.exact), std::pow(size * x.signal.most(), e.exact),
        1.2 * kUnit + power * (5e-9 + e.exact * (7.5e-8 + 0.7 * x.gain.logarithm)) + by_exponent * e.error + by_input};
  }
  static Value pow_abs(const State& x, const Exponent&) {
    ProofFailure::note("a power of its own state moves it");
    return {0.0, std::max(1.0, x.most()), 1.0};
  }

  template <std::size_t Size>
  static Value table(const std::array<Value, Size>& values, std::int32_t points, const Scaled& x) {
    const double at = std::min(std::abs(x.gain.exact) * x.signal.most(), static_cast<double>(points));
    return on_lines(values, points, false, at * x.gain.relative + std::abs(x.gain.exact) * x.signal.error + 0x1p-44);
  }
  template <std::size_t Size>
  static Value table_over_turn(const std::array<Value, Size>& values, std::int32_t points, const Angle& phase) {
    return on_lines(values, points, true, phase.error_turns * points + 0x1p-32);
  }
  static Sum wave(const Harmonic& h, const Angle& angle) {
    // A sine of two units, a phase in three steps of a unit and rounded itself.
    const double phase = h.order.error * angle.most_turns + 3.5 * kPhaseUnit;
    return {-h.amplitude, h.amplitude, h.error + (h.amplitude + h.error) * (2.0 * kUnit + kTurn * phase)};
  }
  static Sum wave_times(const Harmonic& h, const Angle& angle, const Value& x) {
    const Sum whole = wave(h, angle);
    const double most = x.most();
    return {-h.amplitude * most, h.amplitude * most, most * whole.error + (h.amplitude + h.error) * (x.error + kUnit)};
  }
  static Angle times_order(const Angle& angle, const Order& order) {
    return {angle.most_turns * std::abs(order.cycles), 0.0,
            order.error * angle.most_turns + std::abs(order.cycles) * angle.error_turns + kPhaseUnit};
  }
  static Wave sincos(const Angle& phase) {
    const Value wave{-1.0, 1.0, kUnit + kTurn * phase.error_turns};
    return {wave, wave};
  }

  // What the above is made of.
  static double real(std::int64_t raw, int bits) { return std::ldexp(static_cast<double>(raw), -bits); }
  // How far a number in an integer of any power of two is from the exact value, as a share of it.
  static double relative(std::int64_t held, double exact) {
    if (exact == 0.0) return held == 0 ? 0.0 : std::numeric_limits<double>::infinity();
    if (held == 0) return 1.0;
    const double ratio = std::abs(static_cast<double>(held) / exact);
    const double off = std::abs(std::exp2(std::log2(ratio) - std::round(std::log2(ratio))) - 1.0);
    return off + 3e-14;
  }
  template <class To>
  static Bounded<To> scaled_to(double exact, double error, const Value& x) {
    const double a = exact * x.low, b = exact * x.high;
    return {std::min(a, b), std::max(a, b), error * (x.most() + x.error) + std::abs(exact) * x.error};
  }
  template <class To, class A, class B>
  static Bounded<To> product(const A& a, const B& b, double rounding) {
    const double corners[] = {a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
    return {*std::min_element(corners, corners + 4), *std::max_element(corners, corners + 4),
            a.most() * b.error + b.most() * a.error + a.error * b.error + rounding};
  }
  static State within(const State& x, double limit) {
    return {std::clamp(x.low, -limit, limit), std::clamp(x.high, -limit, limit), x.error};
  }
  static void exact_motion(const Value& x) {
    if (x.error > 0.0)
      ProofFailure::note(
          "it moves by a torsion that another effect has changed and rounded, however little that moves in a tick");
  }
  static void of_state(Travel& t, double most_left, double exponent) {
    t.of_state = true;
    t.high *= std::max(1.0, std::pow(most_left, std::max(exponent, 0.0)));
    t.rounding += 2.0 * 0x1p-58;
  }
  // What the roundings of a state add up to until motion has forgotten them.
  static double roundings_of(const DecayFactor& kept) {
    const Travel& t = kept.travel;
    if (t.least <= 0.0) return 0.0;
    const double rounding = kStateUnit + t.rounding;
    if (!t.of_state) return rounding / -std::expm1(-t.least);
    const double rate = std::min(0.5 / t.high, std::pow(0.5, kept.exponent));
    return 1.05 * rounding / t.least / rate * std::exp(rate * t.high);
  }
  template <std::size_t Size>
  static Value on_lines(const std::array<Value, Size>& values, std::int32_t points, bool round, double place) {
    Value all = values[0];
    double rise = 0.0;
    for (std::int32_t k = 0; k < points; ++k) {
      const Value& v = values[static_cast<std::size_t>(k)];
      all = {std::min(all.low, v.low), std::max(all.high, v.high), std::max(all.error, v.error)};
      const std::int32_t next = k + 1 < points ? k + 1 : round ? 0 : k;
      rise = std::max(rise, std::abs(values[static_cast<std::size_t>(next)].low - v.low));
    }
    all.error += 0.5 * kUnit + rise * (place + 0x1p-30);
    return all;
  }
};

}  // namespace flexspline::deployment
