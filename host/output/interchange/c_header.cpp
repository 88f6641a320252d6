#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <type_traits>

#include "host/output/interchange/c_statements.hpp"
#include "host/output/interchange/export.hpp"
#include "host/physics/catalogue/coefficients.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "shared/effects/list.hpp"

namespace flexspline::interchange {
namespace {

using effects::Phase;
using Inputs = effects::Inputs<CNumbers>;
using Torques = effects::Torques<CNumbers>;
using Constants = effects::DriveConstants<double>;

// What remembers the tick before, and is kept by the caller's struct.
struct Signal {
  const char* name;
  Term Inputs::*at;
};
constexpr Signal kSignals[] = {{"motor_position", &Inputs::angle},
                               {"motor_velocity", &Inputs::velocity},
                               {"motor_speed", &Inputs::speed},
                               {"direction", &Inputs::direction},
                               {"motor_acceleration", &Inputs::acceleration},
                               {"output_position", &Inputs::output_angle},
                               {"output_velocity", &Inputs::output_velocity},
                               {"output_direction", &Inputs::output_direction},
                               {"output_acceleration", &Inputs::output_acceleration},
                               {"torsion", &Inputs::torsion},
                               {"torsion_rate", &Inputs::torsion_rate},
                               {"torsion_direction", &Inputs::torsion_direction},
                               {"torque", &Inputs::torque},
                               {"torque_magnitude", &Inputs::torque_magnitude},
                               {"current", &Inputs::current},
                               {"temperature", &Inputs::temperature},
                               {"elapsed", &Inputs::elapsed}};

// What the caller gives at each step, in C, in the order of the struct.
struct Field {
  const char* name;
  const char* unit_rotary;
  const char* unit_linear;
  const char* meaning;
};
constexpr Field kFields[] = {
    {"motor_position", "rad", "m", "wave-generator side"},
    {"motor_velocity", "rad/s", "m/s", ""},
    {"motor_acceleration", "rad/s^2", "m/s^2", ""},
    {"direction", "-1, 0, 1", "-1, 0, 1", "sign of the motor's velocity or, for a feedforward, of its set point"},
    {"output_position", "rad", "m", ""},
    {"output_velocity", "rad/s", "m/s", ""},
    {"output_acceleration", "rad/s^2", "m/s^2", ""},
    {"output_direction", "-1, 0, 1", "-1, 0, 1", "likewise"},
    {"torque", "N*m", "N", "through the flexspline, at the output; positive when the motor drives forward"},
    {"current", "A", "A", ""},
    {"temperature", "degC", "degC", "of housing or lubricant"},
    {"elapsed", "s", "s", "since the step before"}};

// An effect of the model as it writes itself.
class CodeGenerator {
 public:
  virtual ~CodeGenerator() = default;
  virtual void change(Inputs&) const {}
  virtual void state(std::vector<Term*>&) {}
  virtual void advance(const Inputs&, const Inputs&) {}
  virtual void evaluate(const Inputs&, Torques&) const {}
};

template <class E>
class EffectGenerator final : public CodeGenerator {
 public:
  EffectGenerator(const double* parameters, const Constants& constants)
      : coefficients_(catalogue::coefficients_of<E, CNumbers>(parameters, constants)) {}
  void change(Inputs& in) const override {
    if constexpr (E::kInfo.phase == Phase::shift) E::shift(coefficients_, in);
    if constexpr (E::kInfo.phase == Phase::modulate) E::modulate(coefficients_, in);
  }
  void state(std::vector<Term*>& terms) override {
    using State = typename E::template State<CNumbers>;
    if constexpr (!std::is_empty_v<State>) {
      // States are made of numbers and of nothing else: a rule of shared/effects, which the size shows.
      static_assert(std::is_standard_layout_v<State> && sizeof(State) % sizeof(Term) == 0 &&
                    alignof(State) == alignof(Term));
      auto* first = reinterpret_cast<Term*>(&state_);
      for (std::size_t k = 0; k < sizeof(State) / sizeof(Term); ++k) terms.push_back(first + k);
    }
  }
  void advance(const Inputs& now, const Inputs& before) override {
    if constexpr (!std::is_empty_v<typename E::template State<CNumbers>>)
      E::advance(state_, coefficients_, now, before);
  }
  void evaluate(const Inputs& in, Torques& out) const override {
    if constexpr (requires { E::evaluate(state_, coefficients_, in, out); })
      E::evaluate(state_, coefficients_, in, out);
  }

 private:
  typename E::template Coefficients<CNumbers> coefficients_;
  typename E::template State<CNumbers> state_{};
};

std::unique_ptr<CodeGenerator> author_of(std::string_view name, const std::vector<double>& parameters,
                                         const Constants& constants) {
  std::unique_ptr<CodeGenerator> author;
  effects::for_each_effect([&]<class E>(std::size_t) {
    if (E::kInfo.name == name) author = std::make_unique<EffectGenerator<E>>(parameters.data(), constants);
  });
  return author;
}

struct Placed {
  std::string id;
  const effects::Description* info;
  std::unique_ptr<CodeGenerator> author;
};

std::vector<Placed> authors_of(const model::Model& model, const Constants& constants) {
  std::vector<Placed> all;
  for (const model::Effect& effect : model.effects) {
    const catalogue::Entry& entry = catalogue::entry_of(effect);
    if (effect.type == catalogue::kExpressionEffect)
      throw ExportError(
          fmt::format("\"{}\" is a formula of yours, which has no C form yet; learn a table of it (add "
                      "table_effect:VARIABLE) or write it next to the header",
                      effect.id));
    all.push_back({effect.id, entry.info,
                   author_of(effect.type,
                             effect.type == catalogue::kTableEffect ? catalogue::table_parameters(*effect.definition)
                                                                    : catalogue::values_of(effect, entry),
                             constants)});
  }
  return all;
}

// Shifts, those that act last after the others, then modulations: the order of simulation::Balances.
void change(const std::vector<Placed>& effects, Inputs& in) {
  const Term rate = in.torsion_rate;
  const auto pass = [&](Phase phase, bool last) {
    for (const Placed& p : effects)
      if (p.info->phase == phase && p.info->acts_last == last) p.author->change(in);
  };
  pass(Phase::shift, false);
  pass(Phase::shift, true);
  // A shift that turns with the motor changes the torsion's rate, and with it its direction.
  if (in.torsion_rate.line() != rate.line()) in.torsion_direction = CNumbers::sign(in.torsion_rate);
  pass(Phase::modulate, false);
  pass(Phase::modulate, true);
}

Inputs inputs_of(CStatements& page, const Constants& constants) {
  const auto given = [&](const char* name) { return page.input(std::string("in->") + name); };
  Inputs in;
  in.angle = given("motor_position");
  in.velocity = given("motor_velocity");
  in.acceleration = given("motor_acceleration");
  in.direction = given("direction");
  in.output_angle = given("output_position");
  in.output_velocity = given("output_velocity");
  in.output_acceleration = given("output_acceleration");
  in.output_direction = given("output_direction");
  in.torque = given("torque");
  in.current = given("current");
  in.temperature = given("temperature");
  in.elapsed = given("elapsed");
  in.speed = CNumbers::magnitude(in.velocity);
  in.torque_magnitude = CNumbers::magnitude(in.torque);
  in.torsion = in.angle / Term(constants.gear_ratio) - in.output_angle;
  in.torsion_rate = in.velocity / Term(constants.gear_ratio) - in.output_velocity;
  in.torsion_direction = CNumbers::sign(in.torsion_rate);
  in.viscous_scale = in.coulomb_scale = 1.0;
  return in;
}

struct Helper {
  const char* name;
  const char* text;
};
constexpr Helper kHelpers[] = {
    {"exp_mean", R"(/* (1 - exp(-x)) / x */
static inline double @exp_mean(double x) {
  if (x < 1e-4) return 1.0 - x * (0.5 - x * (1.0 / 6.0));
  return (1.0 - exp(-x)) / x;
}
)"},
    {"q_exp_negative", R"(/* The solution at x of u' = -u^q, u(0) = 1. */
static inline double @q_exp_negative(double x, double q) {
  const double z = (q - 1.0) * x;
  if (z <= -1.0 + 1e-12) return 0.0;
  if (z < 1e-4 && z > -1e-4) return exp(-x * (1.0 - z * (0.5 - z * (1.0 / 3.0 - z * 0.25))));
  return exp(-x * (log(1.0 + z) / z));
}
)"},
    {"table", R"(/* Linear interpolation between the values, at a position counted in points; held beyond both ends. */
static inline double @table(const double* values, int points, double at) {
  int k;
  if (!(at > 0.0)) return values[0];
  if (at >= points - 1.0) return values[points - 1];
  k = (int)at;
  return values[k] + (values[k + 1] - values[k]) * (at - k);
}
)"},
    {"table_over_turn", R"(/* The same at a phase in radians, a turn being the whole table. */
static inline double @table_over_turn(const double* values, int points, double phase) {
  const double turns = phase / 6.283185307179586;
  const double at = (turns - floor(turns)) * points;
  const int k = at < points - 1.0 ? (int)at : points - 1;
  return values[k] + (values[k + 1 < points ? k + 1 : 0] - values[k]) * (at - k);
}
)"}};

std::string array_text(const std::vector<double>& values, std::size_t number) {
  std::string text = fmt::format("static const double @array{}[{}] = {{", number, values.size());
  for (std::size_t k = 0; k < values.size(); ++k)
    text += (k == 0 ? "" : k % 6 == 0 ? ",\n  " : ", ") + literal(values[k]);
  return text + "};\n";
}

void replace_all(std::string& text, std::string_view what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
}

struct Variable {
  std::string name;
  Term value;
};

// What one step computes, as statements.
struct Step {
  CStatements page;
  Inputs now;
  Torques torques;
  std::vector<Term> kept;               // the signals of the step before, as the struct holds them
  std::vector<Variable> states;         // of effects with memory
  std::vector<std::size_t> remembered;  // signals whose value of the step before is used
  std::vector<Term> results;            // all that a step leaves
};

// Two ids may differ in characters alone that C's names do not have, and an id may be the name of a signal.
std::string free_name(const Step& step, const std::string& name) {
  const auto taken = [&](const std::string& wanted) {
    return wanted == "started" ||
           std::any_of(step.states.begin(), step.states.end(), [&](const Variable& s) { return s.name == wanted; }) ||
           std::any_of(std::begin(kSignals), std::end(kSignals), [&](const Signal& s) { return wanted == s.name; });
  };
  std::string free = name;
  for (int number = 2; taken(free); ++number) free = fmt::format("{}_{}", name, number);
  return free;
}

// Adds the statements of an effect, and what it remembers.
void advance_and_evaluate(Step& step, const Placed& effect, const Inputs& before, const Term& started) {
  std::vector<Term*> terms;
  effect.author->state(terms);
  std::vector<Term> rest;
  const std::size_t first = step.states.size();
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const std::string name = c_name(effect.id) + (terms.size() > 1 ? fmt::format("_{}", k) : "");
    step.states.push_back({free_name(step, name), {}});
    *terms[k] = step.page.input("state->" + step.states.back().name);
    rest.push_back(*terms[k]);
  }
  effect.author->advance(step.now, before);
  // The first step only stores the position of the drive.
  for (std::size_t k = 0; k < terms.size(); ++k) {
    *terms[k] = step.page.line("(%0 ? %1 : %2)", {started, *terms[k], rest[k]});
    step.states[first + k].value = *terms[k];
  }
  effect.author->evaluate(step.now, step.torques);
}

// Writes the statements into `step`, whose page the numbers of the effects write to meanwhile.
void compute(Step& step, const std::vector<Placed>& effects, const Constants& constants) {
  step.now = inputs_of(step.page, constants);
  change(effects, step.now);
  const Term started = step.page.input("state->started");
  Inputs before = step.now;
  for (const Signal& signal : kSignals) {
    step.kept.push_back(step.page.input(std::string("state->") + signal.name));
    before.*signal.at = step.page.line("(%0 ? %1 : %2)", {started, step.kept.back(), step.now.*signal.at});
  }
  for (const Placed& effect : effects) advance_and_evaluate(step, effect, before, started);
}

void find_results(Step& step) {
  step.results = {step.torques.motor, step.torques.transmission, step.torques.load};
  for (const Variable& s : step.states) step.results.push_back(s.value);
  for (std::size_t k = 0; k < std::size(kSignals); ++k)
    if (step.page.uses(step.kept[k], step.results)) step.remembered.push_back(k);
  for (const std::size_t k : step.remembered) step.results.push_back(step.now.*kSignals[k].at);
}

std::string body_text(Step& step) {
  std::string body = step.page.statements(step.results);
  for (const Variable& s : step.states) body += fmt::format("  state->{} = {};\n", s.name, step.page.text(s.value));
  for (const std::size_t k : step.remembered)
    body += fmt::format("  state->{} = {};\n", kSignals[k].name, step.page.text(step.now.*kSignals[k].at));
  return body + fmt::format("  state->started = 1;\n  out->motor = {};\n  out->transmission = {};\n  out->load = {};\n",
                            step.page.text(step.torques.motor), step.page.text(step.torques.transmission),
                            step.page.text(step.torques.load));
}

// Tables and functions that the statements use.
std::string prelude_text(const Step& step) {
  std::string prelude;
  for (std::size_t k = 0; k < step.page.arrays().size(); ++k) prelude += array_text(step.page.arrays()[k], k);
  for (const Helper& helper : kHelpers)
    if (step.page.calls(std::string("@") + helper.name, step.results)) prelude += helper.text;
  return prelude;
}

std::string fields_text(bool linear) {
  std::string fields;
  for (const Field& f : kFields)
    fields += fmt::format("  double {}; /* {}{}{} */\n", f.name, linear ? f.unit_linear : f.unit_rotary,
                          *f.meaning ? ": " : "", f.meaning);
  return fields;
}

std::string memory_text(const Step& step) {
  std::string memory;
  for (const Variable& s : step.states) memory += fmt::format("  double {};\n", s.name);
  for (const std::size_t k : step.remembered) memory += fmt::format("  double {};\n", kSignals[k].name);
  return memory;
}

std::string ids_of(const std::vector<Placed>& effects) {
  std::string list;
  for (const Placed& p : effects) list += (list.empty() ? "" : ", ") + p.id;
  return list;
}

// "@" stands for the model's name, in capitals before macros.
constexpr const char* kPage = R"(/* Model "{model}", written by flexspline export from {source}. C99; needs <math.h>.
 *
 * Torques on the right-hand side of the three balances of a drive with a strain-wave gear, in SI; positive resists
 * positive motion:
 *   motor         Km i = motor + T/N
 *   transmission  T    = transmission
 *   load          T    = load + external torque
 * so the current that a motion takes is (out.motor + torque / @GEAR_RATIO) / @TORQUE_CONSTANT.
 *
 *   @state state = {{0}};                         start from rest
 *   @step(&state, &in, &out);                     once a sample, in order: effects with memory go on from there
 *
 * Effects: {effects}
 */
#ifndef @H
#define @H

#include <math.h>

#define @GEAR_RATIO {ratio}
#define @TORQUE_CONSTANT {km} /* {km_unit} */

typedef struct {{
{fields}}} @inputs;

typedef struct {{
  int started;
{memory}}} @state;

typedef struct {{
  double motor;        /* {unit}, motor side */
  double transmission; /* {unit}, output side */
  double load;         /* {unit}, output side */
}} @torques;

{prelude}
static inline void @step(@state* state, const @inputs* in, @torques* out) {{
{body}}}

#endif
)";

// A comment ends at the first "*/", and some compilers warn of "/*" within it.
std::string comment_text(std::string text) {
  replace_all(text, "*/", "* /");
  replace_all(text, "/*", "/ *");
  return text;
}

// Each name begins with the model's.
std::string with_prefix(std::string text, const std::string& name) {
  std::string upper = name;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  for (const char* macro : {"GEAR_RATIO", "TORQUE_CONSTANT", "H\n"})
    replace_all(text, std::string("@") + macro, upper + "_" + macro);
  replace_all(text, "@", name + "_");
  return text;
}

}  // namespace

std::string c_name(std::string_view name) {
  std::string out;
  for (const char c : name) out += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  if (out.empty() || std::isdigit(static_cast<unsigned char>(out.front()))) out = "model_" + out;
  return out;
}

std::string c_header(const model::Model& model, const std::string& source) {
  const Constants constants = catalogue::constants_of(model.drive);
  const bool linear = model.drive.axis == data::Axis::linear;
  Step step;
  c_statements() = &step.page;
  const std::vector<Placed> effects = authors_of(model, constants);
  compute(step, effects, constants);
  c_statements() = nullptr;
  find_results(step);
  const std::string body = body_text(step);
  const std::string text = fmt::format(
      fmt::runtime(kPage), fmt::arg("model", comment_text(model.name)), fmt::arg("source", comment_text(source)),
      fmt::arg("effects", comment_text(ids_of(effects))), fmt::arg("ratio", literal(constants.gear_ratio)),
      fmt::arg("km", literal(constants.torque_constant)), fmt::arg("km_unit", linear ? "N/A" : "N*m/A"),
      fmt::arg("fields", fields_text(linear)), fmt::arg("memory", memory_text(step)),
      fmt::arg("unit", linear ? "N" : "N*m"), fmt::arg("prelude", prelude_text(step)), fmt::arg("body", body));
  return with_prefix(text, c_name(model.name));
}

}  // namespace flexspline::interchange
