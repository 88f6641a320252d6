#include "host/physics/catalogue/formula_entry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/physics/catalogue/formula.hpp"

namespace flexspline::catalogue {
namespace {

double plain(const numbers::Jet& x) {
  return x.a;
}
double slope(const numbers::Jet& x) {
  return x.v[0];
}

// Inputs moved along their derivatives.
effects::Inputs<Real> moved(const effects::Inputs<Dual>& in, double step) {
  const auto at = [step](const numbers::Jet& x) { return x.a + step * x.v[0]; };
  return {at(in.angle),           at(in.velocity),         at(in.speed),
          at(in.direction),       at(in.acceleration),     at(in.output_angle),
          at(in.output_velocity), at(in.output_direction), at(in.output_acceleration),
          at(in.torsion),         at(in.torsion_rate),     at(in.torsion_direction),
          at(in.torque),          at(in.torque_magnitude), at(in.current),
          at(in.temperature),     at(in.viscous_scale),    at(in.coulomb_scale),
          at(in.elapsed)};
}

// Where parameters are moved along their derivatives by a share of themselves, a central difference is good to ten
// digits.
constexpr double kShareOfStep = 1e-5;

class FormulaFunctions {
 public:
  FormulaFunctions(std::string text, std::vector<std::string> parameters, Balance balance)
      : text_(std::move(text)), parameters_(std::move(parameters)), balance_(balance) {}

  // A parser of its own for each call, so that threads need not share one.
  Formula formula() const { return {text_, parameters_}; }

  void add(const double* parameters, const DriveConstants<double>& drive, Balance balance, const PlainInputs& inputs,
           double* sum) const {
    if (balance != balance_) return;
    Formula f = formula();
    add(f, {parameters, parameters_.size()}, drive.turn_angle_scale, inputs, sum);
  }

  void add(const numbers::Jet* parameters, const DriveConstants<numbers::Jet>& drive, Balance balance,
           const PlainInputs& inputs, numbers::Jet* sum) const {
    if (balance != balance_) return;
    Formula f = formula();
    const double step = step_of(parameters);
    const double scale = drive.turn_angle_scale.a;
    std::vector<double> at(inputs.size(), 0.0), up(inputs.size(), 0.0), down(inputs.size(), 0.0);
    add(f, along(parameters, 0.0), scale, inputs, at.data());
    add(f, along(parameters, step), scale, inputs, up.data());
    add(f, along(parameters, -step), scale, inputs, down.data());
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      sum[k].a += at[k];
      sum[k].v[0] += (up[k] - down[k]) / (2.0 * step);
    }
  }

  void add(const numbers::Jet* parameters, const DriveConstants<numbers::Jet>& drive, Balance balance,
           std::span<const effects::Inputs<Dual>> inputs, numbers::Jet* sum) const {
    if (balance != balance_) return;
    // A shift moves each sample's signals by as much as they change per unit of a nonlinear parameter of its own.
    double step = step_of(parameters);
    double largest = 0.0, slopes = 0.0;
    for (const auto& in : inputs) {
      largest = std::max(largest, std::abs(plain(in.torsion)));
      slopes = std::max(slopes, std::abs(slope(in.torsion)));
    }
    if (slopes > 0.0) step = std::min(step, kShareOfStep * std::max(largest, 1e-12) / slopes);
    Formula f = formula();
    const double scale = drive.turn_angle_scale.a;
    std::vector<effects::Inputs<Real>> at(inputs.size());
    std::vector<double> value(inputs.size(), 0.0), up(inputs.size(), 0.0), down(inputs.size(), 0.0);
    for (auto [by, to] : {std::pair{0.0, value.data()}, {step, up.data()}, {-step, down.data()}}) {
      for (std::size_t k = 0; k < inputs.size(); ++k) at[k] = moved(inputs[k], by);
      add(f, along(parameters, by), scale, at, to);
    }
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      sum[k].a += value[k];
      sum[k].v[0] += (up[k] - down[k]) / (2.0 * step);
    }
  }

 private:
  static void add(Formula& f, std::span<const double> parameters, double turn_angle_scale, const PlainInputs& inputs,
                  double* sum) {
    try {
      inputs.each_block([&](std::size_t first, std::span<const effects::Inputs<Real>> block) {
        f.add(parameters, turn_angle_scale, block, sum + first);
      });
    } catch (const FormulaError& error) {
      throw model::ModelError(fmt::format("{}; {}", error.what(), error.remedy()));
    }
  }
  std::vector<double> along(const numbers::Jet* parameters, double step) const {
    std::vector<double> values;
    for (std::size_t p = 0; p < parameters_.size(); ++p) values.push_back(parameters[p].a + step * parameters[p].v[0]);
    return values;
  }
  double step_of(const numbers::Jet* parameters) const {
    double step = 1.0;
    for (std::size_t p = 0; p < parameters_.size(); ++p)
      if (parameters[p].v[0] != 0.0)
        step = std::min(step, kShareOfStep * std::max(std::abs(parameters[p].a), 1e-9) / std::abs(parameters[p].v[0]));
    return step;
  }

  std::string text_;
  std::vector<std::string> parameters_;
  Balance balance_;
};

class FormulaInstance final : public Instance {
 public:
  FormulaInstance(Formula formula, std::vector<double> parameters, double turn_angle_scale, Balance balance)
      : formula_(std::move(formula)),
        parameters_(std::move(parameters)),
        turn_angle_scale_(turn_angle_scale),
        balance_(balance) {}
  void evaluate(const effects::Inputs<Real>& in, effects::Torques<Real>& out) const override {
    formula_.add(parameters_, turn_angle_scale_, {&in, 1}, &effects::torque_on<Real>(balance_, out));
  }
  void evaluate_ahead(const effects::Inputs<Real>& now, const effects::Inputs<Real>&,
                      effects::Torques<Real>& out) const override {
    evaluate(now, out);
  }
  void advance(const effects::Inputs<Real>&, const effects::Inputs<Real>&) override {}

 private:
  mutable Formula formula_;  // its buffers are no state
  std::vector<double> parameters_;
  double turn_angle_scale_;
  Balance balance_;
};

std::vector<std::string> names_of(const model::Effect& effect) {
  std::vector<std::string> names;
  for (const model::Parameter& p : effect.parameters) names.push_back(p.name);
  return names;
}

effects::Inputs<Real> drawn_inputs(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  // Cubed, so that small values, where saturating laws bend, are drawn as well.
  const auto draw = [&](double size) { return size * std::pow(unit(random), 3.0); };
  effects::Inputs<Real> in{};
  in.angle = draw(20.0);
  in.velocity = draw(100.0);
  in.acceleration = draw(1000.0);
  in.output_angle = draw(2.0);
  in.output_velocity = draw(1.0);
  in.output_acceleration = draw(10.0);
  in.torsion = draw(5e-3);
  in.torsion_rate = draw(0.1);
  in.torque = draw(30.0);
  in.current = draw(3.0);
  in.temperature = 30.0 + draw(20.0);
  const auto sign = [](double x) { return x < 0.0 ? -1.0 : 1.0; };
  in.speed = std::abs(in.velocity);
  in.direction = sign(in.velocity);
  in.output_direction = sign(in.output_velocity);
  in.torsion_direction = sign(in.torsion_rate);
  in.torque_magnitude = std::abs(in.torque);
  in.viscous_scale = in.coulomb_scale = 1.0;
  return in;
}

}  // namespace

const effects::Description kExpression{
    .name = "expression_effect",
    .equation = "the user's formula over the signals",
    .shows_over = "the signals that it reads",
    .source = "the user",
    .explanation =
        "A torque that you write as a formula over the signals, with parameters of your own; they are fitted as those "
        "of any other effect.",
    .causes = "What you know of the machine and the catalogue does not: a seal's law, a spring, a brake.",
    .confused_with = kTableEffect,
    .separated_by = "motion over the whole range of the signals that the formula reads",
    .host_only = true,
    .user_defined = true,
};

Balance balance_named(std::string_view name) {
  return name == "transmission" ? Balance::transmission : name == "load" ? Balance::load : Balance::motor;
}

// In which parameters a formula is linear, by trial.
class LinearityTest {
 public:
  explicit LinearityTest(const model::Effect& effect)
      : effect_(effect), formula_(effect.definition->formula, names_of(effect)) {}

  // f(x + u + v) - f(x + u) - f(x + v) + f(x) is zero where f is linear in the set.
  bool is_linear(const std::vector<std::uint8_t>& set) {
    return holds(set, [&](const Point& at, const Point& u, const Point& v, const Inputs& in) -> std::optional<bool> {
      Point one = at, other = at, both = at;
      for (std::size_t p = 0; p < at.size(); ++p) {
        one[p] = at[p] + u[p];
        other[p] = at[p] + v[p];
        both[p] = one[p] + v[p];
      }
      const auto f = value(at, in), fu = value(one, in), fv = value(other, in), fuv = value(both, in);
      if (!f || !fu || !fv || !fuv) return std::nullopt;
      const double size = std::abs(*f) + std::abs(*fu) + std::abs(*fv) + std::abs(*fuv);
      return std::abs(*fuv - *fu - *fv + *f) <= kRounding * size;
    });
  }

  // Whether it is zero where the parameters of the set are.
  bool vanishes(const std::vector<std::uint8_t>& set) {
    return holds(set, [&](const Point& at, const Point& u, const Point&, const Inputs& in) -> std::optional<bool> {
      Point zero = at, one = at;
      for (std::size_t p = 0; p < at.size(); ++p) {
        one[p] = at[p] + u[p];
        if (set[p]) zero[p] = 0.0;
      }
      const auto none = value(zero, in);
      const auto some = value(one, in);
      if (!none || !some) return std::nullopt;
      return std::abs(*none) <= kRounding * std::max(std::abs(*some), 1e-30);
    });
  }

 private:
  using Point = std::vector<double>;
  using Inputs = effects::Inputs<Real>;
  static constexpr int kTrials = 60;
  static constexpr double kRounding = 1e-9;

  // At so many points where the formula gives numbers. `test` gives nothing where it does not.
  template <class Test>
  bool holds(const std::vector<std::uint8_t>& set, const Test& test) {
    int decided = 0;
    for (int trial = 0; trial < 4 * kTrials && decided < kTrials; ++trial) {
      const Inputs in = drawn_inputs(random_);
      Point x(set.size()), u(set.size(), 0.0), v(set.size(), 0.0);
      for (std::size_t p = 0; p < set.size(); ++p) {
        x[p] = drawn(effect_.parameters[p]);
        if (!set[p]) continue;
        u[p] = (unit_(random_) - 0.5) * std::max(std::abs(x[p]), 1e-3);
        v[p] = (unit_(random_) - 0.5) * std::max(std::abs(x[p]), 1e-3);
      }
      const std::optional<bool> kept = test(x, u, v, in);
      if (!kept) continue;
      ++decided;
      if (!*kept) return false;
    }
    return decided > 0;
  }

  double drawn(const model::Parameter& p) {
    if (p.low && p.high) return *p.low + (*p.high - *p.low) * unit_(random_);
    if (p.low) return *p.low + std::max(1.0, std::abs(*p.low)) * unit_(random_);
    if (p.high) return *p.high - std::max(1.0, std::abs(*p.high)) * unit_(random_);
    return 2.0 * unit_(random_) - 1.0;
  }

  // Nothing where the formula gives no number: its domain ends there.
  std::optional<double> value(const Point& at, const Inputs& in) {
    double sum = 0.0;
    try {
      formula_.add(at, 1.0, {&in, 1}, &sum);
    } catch (const FormulaError&) {
      return std::nullopt;
    }
    return sum;
  }

  const model::Effect& effect_;
  Formula formula_;
  std::mt19937 random_{7};
  std::uniform_real_distribution<double> unit_{0.0, 1.0};
};

std::vector<std::uint8_t> linear_in(const model::Effect& effect) {
  LinearityTest test(effect);
  std::vector<std::uint8_t> set(effect.parameters.size(), 0);
  for (std::size_t p = 0; p < set.size(); ++p) {
    set[p] = 1;
    if (!test.is_linear(set)) set[p] = 0;
  }
  if (!test.vanishes(set)) std::fill(set.begin(), set.end(), std::uint8_t{0});
  return set;
}

void make_formula(UserDefinedEntry& defined, const model::Effect& effect) {
  const model::Definition& d = defined.definition;
  const std::vector<std::uint8_t> linear = linear_in(effect);
  for (const model::Parameter& p : effect.parameters) {
    defined.names.push_back(p.name);
    defined.units.push_back(p.unit.empty() ? "1" : p.unit);
  }
  for (std::size_t p = 0; p < effect.parameters.size(); ++p) {
    effects::ParameterInfo info;
    info.name = defined.names[p];
    info.unit = {defined.units[p], defined.units[p]};
    info.kind = linear[p] ? Kind::linear : Kind::nonlinear;
    info.low = effect.parameters[p].low.value_or(-effects::kUnbounded);
    info.high = effect.parameters[p].high.value_or(effects::kUnbounded);
    if (!linear[p]) {
      const bool scales = info.low > 0.0 && info.high > 20.0 * info.low;
      info.limit = scales ? effects::Limit::scale : effects::Limit::stated;
      info.usual = scales ? std::sqrt(info.low * info.high) : 0.5 * (info.low + info.high);
    } else {
      info.usual = 1.0;
    }
    defined.parameters.push_back(info);
  }
  const Balance balance = balance_named(d.balance);
  const FormulaFunctions along(d.formula, defined.names, balance);
  defined.info = kExpression;
  defined.info.reads = along.formula().reads();
  defined.equation = d.formula;
  defined.entry.label = fmt::format("{}:{}", kExpression.name, d.formula);
  defined.entry.parameters = defined.parameters;
  defined.entry.real.torque = [along](const double* p, const DriveConstants<double>& drive, Balance to,
                                      std::span<const effects::Inputs<Real>> in,
                                      double* sum) { along.add(p, drive, to, in, sum); };
  defined.entry.real.torque_of_plain = [along](const double* p, const DriveConstants<double>& drive, Balance to,
                                               const PlainInputs& in,
                                               double* sum) { along.add(p, drive, to, in, sum); };
  defined.entry.dual.torque_of_plain = [along](const numbers::Jet* p, const DriveConstants<numbers::Jet>& drive,
                                               Balance to, const PlainInputs& in,
                                               numbers::Jet* sum) { along.add(p, drive, to, in, sum); };
  defined.entry.dual.torque = [along](const numbers::Jet* p, const DriveConstants<numbers::Jet>& drive, Balance to,
                                      std::span<const effects::Inputs<Dual>> in,
                                      numbers::Jet* sum) { along.add(p, drive, to, in, sum); };
  defined.entry.make = [along, balance, count = defined.names.size()](
                           const double* p, const DriveConstants<double>& drive) -> std::unique_ptr<Instance> {
    return std::make_unique<FormulaInstance>(along.formula(), std::vector<double>(p, p + count), drive.turn_angle_scale,
                                             balance);
  };
}

std::optional<model::Objection> objection_to_formula(const model::Effect& effect) {
  try {
    Formula(effect.definition->formula, names_of(effect));
  } catch (const FormulaError& error) {
    return model::Objection{"formula", error.what(), error.remedy()};
  }
  const std::vector<std::uint8_t> linear = linear_in(effect);
  for (std::size_t p = 0; p < linear.size(); ++p) {
    const model::Parameter& parameter = effect.parameters[p];
    if (linear[p] || parameter.fixed || (parameter.low && parameter.high)) continue;
    return model::Objection{
        parameter.name,
        fmt::format("{} does not only scale the torque, so that it is searched for, and has no bounds", parameter.name),
        fmt::format("write {} = {{ low = ..., high = ... }}", parameter.name)};
  }
  return std::nullopt;
}

}  // namespace flexspline::catalogue
