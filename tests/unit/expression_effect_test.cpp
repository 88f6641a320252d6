// A formula as an effect: the same torques and estimates as the effect of the catalogue that it writes down, and errors
// that say what is wrong.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/estimation/identify.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/formula.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "host/physics/simulation/balances.hpp"

namespace flexspline::catalogue::expression_effect_test {
namespace {

using data::Column;
using Inputs = effects::Inputs<Real>;

constexpr double kPi = 3.14159265358979323846;

model::Parameter parameter(std::string name, std::string unit, std::optional<double> low = {},
                           std::optional<double> high = {}) {
  model::Parameter p;
  p.name = std::move(name);
  p.unit = std::move(unit);
  p.low = low;
  p.high = high;
  return p;
}

model::Effect formula_of(const std::string& text, std::vector<model::Parameter> parameters,
                         const std::string& balance = "motor") {
  model::Effect effect{"expression_effect", "mine", std::move(parameters), model::Definition{}};
  effect.definition->formula = text;
  effect.definition->balance = balance;
  return effect;
}

double torque_of(const Entry& entry, const std::vector<double>& values, const Inputs& in) {
  double sum = 0.0;
  entry.real.torque(values.data(), {}, entry.info->balance, {&in, 1}, &sum);
  return sum;
}

std::string objection(const model::Effect& effect) {
  const auto found = objection_to(effect);
  return found ? fmt::format("{}: {}; {}", found->key, found->what, found->remedy) : "";
}

TEST(Formula, IsEvaluatedAtEverySampleAsWrittenHere) {
  Formula formula("a*tanh(velocity/b) + (torque > 0 ? 1 : -1)*abs(torsion)^2 + sin(2*motor_angle)*direction + pi",
                  {"a", "b"});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Inputs> inputs(1000);
  for (Inputs& in : inputs) {
    in.velocity = 10.0 * unit(random);
    in.torque = unit(random);
    in.torsion = unit(random);
    in.angle = 100.0 * unit(random);
    in.direction = unit(random) > 0.0 ? 1.0 : -1.0;
  }
  const double parameters[] = {0.3, 2.0};
  std::vector<double> torque(inputs.size(), 1.0);
  formula.add(parameters, 1.0, inputs, torque.data());
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    const Inputs& in = inputs[k];
    const double expected = 0.3 * std::tanh(in.velocity / 2.0) +
                            (in.torque > 0.0 ? 1.0 : -1.0) * in.torsion * in.torsion +
                            std::sin(2.0 * in.angle) * in.direction + kPi;
    EXPECT_NEAR(torque[k], 1.0 + expected, 1e-12);
    double alone = 0.0;
    formula.add(parameters, 1.0, {&in, 1}, &alone);
    EXPECT_NEAR(alone, expected, 1e-12);
  }
  EXPECT_EQ(formula.reads(),
            effects::kMotorMotion | effects::kTorque | effects::kTorsion | effects::kMotorAngle | effects::kDirection);
}

TEST(Formula, ErrorsSayWhatIsWrongAndWhichSignalsThereAre) {
  EXPECT_EQ(objection(formula_of("a*tanh(velocty)", {parameter("a", "N*m")})),
            "formula: the formula reads velocty, which is neither a signal nor a parameter; did you mean velocity? "
            "signals are velocity, speed, acceleration, motor_angle, output_velocity, output_acceleration, "
            "output_angle, torsion, torsion_rate, torque, torque_magnitude, current, temperature, direction, "
            "output_direction, torsion_direction; parameters are a: a new one is declared below [effect.parameters]");
  const auto says = [](const std::string& text, std::vector<model::Parameter> parameters, const char* what) {
    const std::string found = objection(formula_of(text, std::move(parameters)));
    EXPECT_NE(found.find(what), std::string::npos) << found;
  };
  says("a*tanh(velocity", {parameter("a", "N*m")}, "cannot be read");
  says("a*", {parameter("a", "N*m")}, "cannot be read");
  says("", {}, "the formula is empty");
  says("velocity = 3", {}, "assigns nothing");
  says("velocity, torque", {}, "more than one result");
  says("velocity", {parameter("a", "N*m")}, "does not use its parameter a");
  says("torque*torque", {parameter("torque", "N*m")}, "the name of a signal");
  says("a*tanh(velocity/b)", {parameter("a", "N*m"), parameter("b", "rad/s")},
       "b: b does not only scale the torque, so that it is searched for, and has no bounds; write b = { low = ..., "
       "high");
  EXPECT_EQ(objection(formula_of("a*(velocity >= 1)", {parameter("a", "N*m")})), "");
}

TEST(Formula, SaysWhereItGivesNoNumber) {
  const Entry& entry = entry_of(formula_of("a*ln(velocity)", {parameter("a", "N*m")}));
  Inputs in;
  in.velocity = -2.0;
  try {
    torque_of(entry, {1.0}, in);
    FAIL() << "the logarithm of a negative number passed";
  } catch (const model::ModelError& error) {
    EXPECT_NE(std::string(error.what()).find("gives no number at a = 1, velocity = -2"), std::string::npos)
        << error.what();
  }
}

TEST(Expression, ParametersThatOnlyScaleTheTorqueAreLinear) {
  const auto kinds = [](const std::string& text, const std::vector<std::string>& names) {
    std::vector<model::Parameter> parameters;
    for (const std::string& name : names) parameters.push_back(parameter(name, "1", 0.5, 2.0));
    std::string found;
    for (const auto& p : entry_of(formula_of(text, parameters)).parameters) found += p.kind == Kind::linear ? 'l' : 's';
    return found;
  };
  EXPECT_EQ(kinds("a*tanh(velocity/b) + c*velocity", {"a", "b", "c"}), "lsl");
  EXPECT_EQ(kinds("c*velocity + a*tanh(velocity/b)", {"c", "b", "a"}), "lsl");
  EXPECT_EQ(kinds("a*b*velocity", {"a", "b"}), "ls") << "a product: the first scales";
  EXPECT_EQ(kinds("a*velocity + velocity^2", {"a"}), "s") << "a part that nothing scales";
  EXPECT_EQ(kinds("(a + b)*torque + c*sin(d*motor_angle)", {"a", "b", "c", "d"}), "llls");
  EXPECT_EQ(kinds("a*sqrt(abs(torque)) - b*direction", {"a", "b"}), "ll");
  EXPECT_EQ(kinds("a*ln(temperature)", {"a"}), "l");
  EXPECT_EQ(kinds("velocity", {}), "");
}

TEST(Expression, DerivativesAgreeWithClosedForms) {
  const Entry& entry =
      entry_of(formula_of("a*tanh(torsion/b)", {parameter("a", "N*m"), parameter("b", "rad", 0.1, 9.0)}));
  const double a = 0.7, b = 2.0, x = 1.3, c = std::cosh(x / b);
  Inputs in;
  in.torsion = x;
  const auto slope = [&](numbers::Jet pa, numbers::Jet pb) {
    const numbers::Jet p[] = {pa, pb};
    numbers::Jet sum(0.0);
    entry.dual.torque_of_plain(p, {}, Balance::motor, {&in, 1}, &sum);
    EXPECT_DOUBLE_EQ(sum.a, a * std::tanh(x / b));
    return sum.v[0];
  };
  EXPECT_NEAR(slope(numbers::Jet(a, 0), numbers::Jet(b)), std::tanh(x / b), 1e-9);
  EXPECT_NEAR(slope(numbers::Jet(a), numbers::Jet(b, 0)), -a * x / (b * b) / (c * c), 1e-9);
  effects::Inputs<Dual> shifted;
  shifted.torsion = numbers::Jet(x, 0);
  const numbers::Jet p[] = {numbers::Jet(a), numbers::Jet(b)};
  numbers::Jet sum(0.0);
  entry.dual.torque(p, {}, Balance::motor, {&shifted, 1}, &sum);
  EXPECT_NEAR(sum.v[0], a / b / (c * c), 1e-9);
}

TEST(Expression, IsNotTakenForAStraightLineInASimulation) {
  model::Model model;
  model::Effect effect = formula_of("a*max(0, speed - 50)", {parameter("a", "N*m*s/rad")});
  effect.parameters[0].value = 2.0;
  model.effects.push_back(effect);
  const simulation::Balances balances(model, {});
  Inputs in;
  in.speed = in.velocity = 60.0;
  effects::Torques<Real> sums;
  balances.add_motor(in, in, sums);
  EXPECT_DOUBLE_EQ(sums.motor, 20.0);
}

// A motor with friction that saturates, on a motion of three sines, with noise that is the same in both fits.
data::Dataset motion(double noise) {
  data::Dataset dataset;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int record = 0; record < 3; ++record) {
    data::Experiment e;
    e.name = "r" + std::to_string(record);
    e.sample_s = 1e-3;
    e.current_hold = data::CurrentHold::none;
    for (int k = 0; k < 6000; ++k) {
      const double t = 1e-3 * k;
      double q = 0.0, w = 0.0, a = 0.0;
      for (const auto& [size, hz] : {std::pair{3.0 + record, 1.0}, {0.4, 2.7}, {0.1, 5.3}}) {
        const double rate = 2.0 * kPi * hz, angle = rate * t + record;
        q += size * std::sin(angle);
        w += size * rate * std::cos(angle);
        a -= size * rate * rate * std::sin(angle);
      }
      e.time_s.push_back(t);
      e[Column::motor_position].push_back(q);
      const double friction = (w > 0.0 ? 1.0 : -1.0) * (0.05 + 0.03 * std::exp(-std::pow(w / 6.0, 2.0)));
      e[Column::motor_torque].push_back(1e-3 * a + 4e-3 * w + friction + noise * normal(random));
    }
    e.segments = {{0, 6000}};
    dataset.experiments.push_back(std::move(e));
  }
  return dataset;
}

const estimation::Estimate& estimate(const estimation::Identification& found, std::string_view id,
                                     std::string_view parameter) {
  for (const estimation::Estimate& e : found.estimates)
    if (e.id == id && e.parameter == parameter) return e;
  throw std::out_of_range(std::string(id));
}

TEST(Expression, LinearFormulaGivesTheEstimatesOfTheEffectThatItWrites) {
  const data::Dataset dataset = motion(1e-3);
  model::Model published, written;
  for (const char* type : {"inertia", "viscous_friction", "coulomb_friction"}) {
    published.effects.push_back(blank_effect(get(type), data::Axis::rotary));
    if (std::string_view(type) != "inertia") written.effects.push_back(published.effects.back());
  }
  written.effects.push_back(formula_of("c*acceleration", {parameter("c", "kg*m^2", 0.0)}));
  const auto theirs = estimation::identify(dataset, published, {40.0, true});
  const auto ours = estimation::identify(dataset, written, {40.0, true});
  const auto& a = estimate(*theirs, "inertia", "inertia");
  const auto& b = estimate(*ours, "mine", "c");
  EXPECT_NEAR(b.value / a.value, 1.0, 1e-12);
  EXPECT_NEAR(*b.std / *a.std, 1.0, 1e-9);
  EXPECT_NEAR(*b.spread_percent / *a.spread_percent, 1.0, 1e-9);
  EXPECT_EQ(b.unit, "kg*m^2");
  EXPECT_NEAR(estimate(*ours, "coulomb_friction", "torque").value,
              estimate(*theirs, "coulomb_friction", "torque").value, 1e-12);
}

TEST(Expression, ShapesOfAFormulaAreFoundAsThoseOfTheEffectThatItWrites) {
  const data::Dataset dataset = motion(1e-3);
  model::Model published, written;
  for (const char* type : {"inertia", "viscous_friction", "coulomb_friction"}) {
    published.effects.push_back(blank_effect(get(type), data::Axis::rotary));
    written.effects.push_back(published.effects.back());
  }
  published.effects.push_back(blank_effect(get("stribeck_gaussian"), data::Axis::rotary));
  written.effects.push_back(
      formula_of("direction*exp(-(velocity/vs)^2)*(direction > 0 ? fp : fn)",
                 {parameter("fp", "N*m"), parameter("fn", "N*m"), parameter("vs", "rad/s", 1.0, 20.0)}));
  const auto theirs = estimation::identify(dataset, published, {40.0, true});
  const auto ours = estimation::identify(dataset, written, {40.0, true});
  const auto& a = estimate(*theirs, "stribeck_gaussian", "velocity");
  const auto& b = estimate(*ours, "mine", "vs");
  EXPECT_NEAR(b.value / a.value, 1.0, 0.01);
  EXPECT_NEAR(b.value, 6.0, 0.3);
  EXPECT_NEAR(*b.std / *a.std, 1.0, 0.05);
  EXPECT_EQ(ours->model.find("mine")->find("vs")->value, b.value);
}

}  // namespace
}  // namespace flexspline::catalogue::expression_effect_test
