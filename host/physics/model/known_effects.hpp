// What a model file may name: the effects that exist, their parameters, units and bounds. The catalogue implements it,
// so that reading a file does not depend on how effects are written.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexspline::model {

struct KnownParameter {
  std::string_view name;
  std::string unit_rotary;  // "N*m*s/rad"; empty, "-" or "1" where it has none
  std::string unit_linear;  // the same on a linear axis: "N*s/m"
  double low;               // bounds, both included
  double high;
  bool given;  // order: must be stated by the user, is never estimated
};

// What a file states of an effect in addition to its parameters: nothing, a table, or a formula with parameters of its
// own.
enum class Form : std::uint8_t { plain, table, formula };

struct KnownEffect {
  std::string_view name;
  std::vector<KnownParameter> parameters;
  Form form = Form::plain;
};

struct Effect;

// What is wrong with a user-defined effect. `key` is where: "variable", "table", "formula", or a parameter's name.
struct Objection {
  std::string key, what, remedy;
};

class KnownEffects {
 public:
  virtual ~KnownEffects() = default;
  // nullptr where there is no effect of that name; else valid as long as this object.
  virtual const KnownEffect* find(std::string_view name) const = 0;
  virtual std::vector<std::string_view> names() const = 0;
  // Of a user-defined effect; nothing where it can be used.
  virtual std::optional<Objection> objection(const Effect&) const { return std::nullopt; }
};

}  // namespace flexspline::model
