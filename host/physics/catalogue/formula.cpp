#include "host/physics/catalogue/formula.hpp"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/common/text/nearest.hpp"
#include "shared/effects/variables.hpp"

namespace flexspline::catalogue {
namespace {

using RealInputs = effects::Inputs<numbers::Real>;

struct Direction {
  const char* name;
  double RealInputs::*signal;
  unsigned reads;
};
constexpr Direction kDirections[] = {{"direction", &RealInputs::direction, effects::kMotorMotion | effects::kDirection},
                                     {"output_direction", &RealInputs::output_direction, effects::kOutputMotion},
                                     {"torsion_direction", &RealInputs::torsion_direction, effects::kTorsion}};

double within_turn(double angle) {
  return angle - 2.0 * std::numbers::pi * std::floor(angle / (2.0 * std::numbers::pi));
}

// A signal or a parameter that the formula names.
struct Name {
  std::string name;
  unsigned reads = 0;
  double RealInputs::*direction = nullptr;
  effects::Variable variable{};
  std::size_t parameter = 0;
  bool is_parameter = false;
  double value = 0.0;

  double of(const RealInputs& in, double turn_angle_scale) const {
    if (direction != nullptr) return in.*direction;
    if (variable == effects::Variable::motor_angle) return within_turn(in.angle * turn_angle_scale);
    if (variable == effects::Variable::output_angle) return within_turn(in.output_angle);
    return effects::signal_of<numbers::Real>(variable, in);
  }
};

std::string listed(const std::vector<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

// An assignment would write into a signal; comparisons are welcome.
bool assigns(std::string_view text) {
  for (std::size_t at = text.find('='); at != std::string_view::npos; at = text.find('=', at + 1)) {
    if (at + 1 < text.size() && text[at + 1] == '=') {
      ++at;
      continue;
    }
    if (at == 0 || std::string_view("<>!").find(text[at - 1]) == std::string_view::npos) return true;
  }
  return false;
}

}  // namespace

class Formula::Parser {
 public:
  Parser(const std::string& text, const std::vector<std::string>& parameters) : text_(text) {
    const std::vector<std::string> known = known_signals();
    for (const std::string& parameter : parameters)
      if (std::find(known.begin(), known.end(), parameter) != known.end())
        throw FormulaError(fmt::format("the parameter {} has the name of a signal", parameter), "give it another name");
    if (text.find_first_not_of(" \t\n") == std::string::npos)
      throw FormulaError("the formula is empty", "write one such as a*tanh(velocity/b)");
    if (assigns(text)) throw FormulaError("a formula assigns nothing", "leave out what is left of the =");
    try {
      parser_.DefineConst("pi", std::numbers::pi);
      parser_.SetExpr(text);
      const std::vector<std::string> used = names_used(known, parameters);
      names_.reserve(used.size());
      for (const std::string& name : used) {
        names_.push_back(meaning(name, parameters));
        parser_.DefineVar(name, &names_.back().value);
      }
      parser_.Eval();
      if (parser_.GetNumResults() != 1)
        throw FormulaError("the formula has more than one result", "write one expression, without commas outside ()");
    } catch (const mu::ParserError& error) {
      throw FormulaError(
          fmt::format("the formula \"{}\" cannot be read: {}", text, error.GetMsg()),
          fmt::format("signals are {}; functions are sin, cos, tan, tanh, exp, ln, sqrt, abs, sign, min, "
                      "max and the like; powers are written ^",
                      listed(known)));
    }
    for (const std::string& parameter : parameters)
      if (std::none_of(names_.begin(), names_.end(), [&](const Name& n) { return n.name == parameter; }))
        throw FormulaError(fmt::format("the formula does not use its parameter {}", parameter),
                           "take it out of the parameters, or put it into the formula");
  }

  void add(std::span<const double> parameters, double turn_angle_scale, std::span<const RealInputs> inputs,
           double* torque) {
    for (Name& n : names_)
      if (n.is_parameter) n.value = parameters[n.parameter];
    // One by one: the packaged parser evaluates whole arrays with OpenMP, whose threads cost up to a hundred times what
    // they save where the processor has other work.
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      for (Name& n : names_)
        if (!n.is_parameter) n.value = n.of(inputs[k], turn_angle_scale);
      const double result = parser_.Eval();
      if (!std::isfinite(result)) no_number();
      torque[k] += result;
    }
  }

  const std::vector<Name>& names() const { return names_; }

 private:
  std::vector<std::string> names_used(const std::vector<std::string>& known,
                                      const std::vector<std::string>& parameters) const {
    std::vector<std::string> used;
    std::vector<std::string> candidates = known;
    candidates.insert(candidates.end(), parameters.begin(), parameters.end());
    for (const auto& [name, value] : parser_.GetUsedVar()) {
      if (std::find(candidates.begin(), candidates.end(), name) == candidates.end()) {
        const std::string meant =
            text::nearest(name, std::vector<std::string_view>(candidates.begin(), candidates.end()));
        throw FormulaError(
            fmt::format("the formula reads {}, which is neither a signal nor a parameter", name),
            fmt::format("{}signals are {}; parameters are {}: a new one is declared below [effect.parameters]",
                        meant.empty() ? "" : fmt::format("did you mean {}? ", meant), listed(known),
                        listed(parameters)));
      }
      used.push_back(name);
    }
    return used;
  }

  static Name meaning(const std::string& name, const std::vector<std::string>& parameters) {
    Name result;
    result.name = name;
    for (const Direction& d : kDirections)
      if (name == d.name) {
        result.direction = d.signal;
        result.reads = d.reads;
      }
    for (const effects::VariableInfo& v : effects::kVariables)
      if (name == v.name) {
        result.variable = v.variable;
        result.reads = v.reads;
      }
    const auto at = std::find(parameters.begin(), parameters.end(), name);
    result.is_parameter = at != parameters.end();
    result.parameter = static_cast<std::size_t>(at - parameters.begin());
    return result;
  }

  [[noreturn]] void no_number() const {
    std::string where;
    for (const Name& n : names_) where += fmt::format("{}{} = {:.4g}", where.empty() ? "" : ", ", n.name, n.value);
    throw FormulaError(fmt::format("the formula \"{}\" gives no number at {}", text_, where),
                       "guard it, as in sqrt(abs(x)) or x/max(y, 0.1), or narrow the bounds of its parameters");
  }

  std::string text_;
  mu::Parser parser_;
  std::vector<Name> names_;
};

Formula::Formula(const std::string& text, const std::vector<std::string>& parameters)
    : parser_(std::make_unique<Parser>(text, parameters)) {}
Formula::~Formula() = default;
Formula::Formula(Formula&&) noexcept = default;

void Formula::add(std::span<const double> parameters, double turn_angle_scale, std::span<const RealInputs> inputs,
                  double* torque) {
  parser_->add(parameters, turn_angle_scale, inputs, torque);
}

unsigned Formula::reads() const {
  unsigned reads = 0;
  for (const Name& n : parser_->names()) reads |= n.reads;
  return reads;
}

std::vector<std::string> Formula::signals() const {
  std::vector<std::string> names;
  for (const Name& n : parser_->names())
    if (!n.is_parameter) names.push_back(n.name);
  return names;
}

std::vector<std::string> Formula::known_signals() {
  std::vector<std::string> names;
  for (const effects::VariableInfo& v : effects::kVariables) names.emplace_back(v.name);
  for (const Direction& d : kDirections) names.emplace_back(d.name);
  return names;
}

}  // namespace flexspline::catalogue
