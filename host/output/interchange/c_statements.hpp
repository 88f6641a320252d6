// A number system that writes C code: an effect evaluated on it yields the C expressions of its torque. So the
// C header of a model comes from the same source as everything else.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace flexspline::interchange {

// A constant, or the result of a statement.
class Term {
 public:
  Term() = default;
  Term(double constant) : constant_(constant) {}
  static Term of_line(int line) {
    Term t;
    t.line_ = line;
    return t;
  }
  bool known() const { return line_ < 0; }
  double constant() const { return constant_; }
  int line() const { return line_; }

 private:
  double constant_ = 0.0;
  int line_ = -1;
};

// The statements so far. An equal statement is used again.
class CStatements {
 public:
  // A line without operands: an input, a state.
  Term input(std::string name);
  // An expression in which %0, %1 ... are the operands.
  Term line(const std::string& expression, const std::vector<Term>& operands);
  // An array of constants, by name.
  std::string array(const std::vector<double>& values);

  // What the results need, in order: "  const double t3 = t1 * t2;\n" and so on.
  std::string statements(const std::vector<Term>& results) const;
  // A term as it is read in an expression: "t3", "in->current_a", "0.25".
  std::string text(const Term& term) const;
  const std::vector<std::vector<double>>& arrays() const { return arrays_; }
  // True where a statement that the results need calls a function of that name.
  bool calls(const std::string& function, const std::vector<Term>& results) const;
  // True where the results need that line.
  bool uses(const Term& line, const std::vector<Term>& results) const;

 private:
  struct Line {
    std::string expression;
    std::vector<Term> operands;
    bool is_input = false;
  };
  std::vector<bool> needed(const std::vector<Term>& results) const;
  std::string filled(const Line& line) const;

  std::vector<Line> lines_;
  std::map<std::string, int> seen_;
  std::vector<std::vector<double>> arrays_;
};

// The statements that this thread writes; set it before an effect is evaluated.
CStatements*& c_statements();

// A double as C reads it back to the bit.
std::string literal(double x);

Term operator+(const Term& a, const Term& b);
Term operator-(const Term& a, const Term& b);
Term operator*(const Term& a, const Term& b);
Term operator/(const Term& a, const Term& b);
Term operator-(const Term& a);
inline Term& operator+=(Term& a, const Term& b) {
  return a = a + b;
}

// numbers::Real is the same in double and says what each function gives.
struct CNumbers {
  using Parameter = double;
  using Value = Term;
  using Angle = Term;
  using Step = Term;
  using Sum = Term;
  using Gain = Term;
  using Weight = Term;
  using StepGain = Term;
  using RatioGain = Term;
  using Ratio = Term;
  using Exponent = Term;
  using Order = Term;
  using State = Term;
  using Share = Term;
  using Travel = Term;
  struct Wave {
    Term cosine;
    Term sine;
  };
  struct Harmonic {
    Term order;
    Term cosine;
    Term sine;
  };

  static Term weight(double p) { return p; }
  static Term gain(double p) { return p; }
  static Term step_gain(double p) { return p; }
  static Term ratio_gain(double p) { return p; }
  static Term value(double p) { return p; }
  static Term share(double p) { return p; }
  static Term exponent(double p) { return p; }
  static Term order(double p) { return p; }
  static double power(double p, double exponent) { return std::pow(p, exponent); }
  static Harmonic harmonic(double order, double cosine, double sine) { return {order, cosine, sine}; }

  static Term one() { return 1.0; }
  static Term sum(const Term& x) { return x; }
  static Term narrow(const Term& x) { return x; }
  static Term widen(const Term& x) { return x; }
  static Term bounded(const Term& x) { return x; }
  static Term times(const Term& a, const Term& b) { return a * b; }
  static Term scaled(const Term& gain, const Term& x) { return gain * x; }
  static Term ratio(const Term& gain, const Term& x) { return gain * x; }
  static Term signal(const Term& gain, const Term& x) { return gain * x; }
  static Term travel(const Term& gain, const Term& x) { return gain * x; }
  static Term step(const Term& travel, const Term& x) { return travel * x; }
  static Term times_order(const Term& angle, const Term& order) { return angle * order; }
  static Term relax(const Term& from, const Term& target, const Term& share) {
    return target + (from - target) * share;
  }
  static Term over(const Term& travel, const Term& x) { return call("%0 / (%1 < 1e-12 ? 1e-12 : %1)", {travel, x}); }
  static Term times_power(const Term& travel, const Term& x, const Term& exponent) {
    return call("%0 * pow(%1 < 1e-9 ? 1e-9 : %1, %2)", {travel, x, exponent});
  }
  static Term sign(const Term& x) { return call("(double)((%0 > 0.0) - (%0 < 0.0))", {x}); }
  static Term magnitude(const Term& x) { return call("fabs(%0)", {x}); }
  static Term clamp(const Term& x, const Term& limit) {
    return call("(%0 > %1 ? %1 : %0 < -(%1) ? -(%1) : %0)", {x, limit});
  }
  static Term between(const Term& x, const Term& low, const Term& high) {
    return call("(%0 > %2 ? %2 : %0 < %1 ? %1 : %0)", {x, low, high});
  }
  static Term clamp_to_one(const Term& x) { return clamp(x, 1.0); }
  static Term by_sign(const Term& x, const Term& a, const Term& b) { return call("(%0 < 0.0 ? %2 : %1)", {x, a, b}); }
  static Wave sincos(const Term& x) { return {call("cos(%0)", {x}), call("sin(%0)", {x})}; }
  static Term wave(const Harmonic& h, const Term& angle) {
    const Wave w = sincos(h.order * angle);
    return h.cosine * w.cosine + h.sine * w.sine;
  }
  static Term wave_times(const Harmonic& h, const Term& angle, const Term& x) { return x * wave(h, angle); }
  static Term gauss(const Term& x) { return call("exp(-(%0) * (%0))", {x}); }
  static Term exp_negative(const Term& x) { return call("exp(-(%0))", {x}); }
  static Term lorentzian(const Term& x) { return call("1.0 / (1.0 + %0 * %0)", {x}); }
  static Term reciprocal(const Term& x) { return call("1.0 / %0", {x}); }
  static Term pow_abs(const Term& x, const Term& exponent) { return call("pow(fabs(%0), %1)", {x, exponent}); }
  static Term exp_mean(const Term& x) { return call("@exp_mean(%0)", {x}); }
  static Term q_exp_negative(const Term& x, const Term& q) { return call("@q_exp_negative(%0, %1)", {x, q}); }
  template <std::size_t Size>
  static Term table(const std::array<Term, Size>& values, int points, const Term& at) {
    return call("@table(" + constants(values.data(), points) + ", %0)", {at});
  }
  template <std::size_t Size>
  static Term table_over_turn(const std::array<Term, Size>& values, int points, const Term& phase) {
    return call("@table_over_turn(" + constants(values.data(), points) + ", %0)", {phase});
  }

 private:
  static Term call(const std::string& expression, const std::vector<Term>& operands) {
    return c_statements()->line(expression, operands);
  }
  // "@array0, 12", the array's name and its length.
  static std::string constants(const Term* values, int points);
};

}  // namespace flexspline::interchange
