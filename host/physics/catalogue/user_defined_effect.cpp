#include "host/physics/catalogue/user_defined_effect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "host/common/text/nearest.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/formula_entry.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::catalogue {
namespace {

using model::Definition;
using model::Objection;

// Steps of a table are even to this share of one: what nine digits leave of a number.
constexpr double kUneven = 1e-4;
constexpr std::size_t kFirstId = 1000;  // beyond those of the catalogue

std::string key_of(const model::Effect& effect) {
  const Definition& d = *effect.definition;
  std::string key =
      fmt::format("{}|{}|{}|{}|{}|{}", effect.type, d.balance, d.variable, d.times_direction, d.table.fixed, d.formula);
  for (const model::Parameter& p : effect.parameters)
    key += fmt::format("|{},{},{:a},{:a}", p.name, p.unit, p.low.value_or(-HUGE_VAL), p.high.value_or(HUGE_VAL));
  for (const auto* list : {&d.table.at, &d.table.value}) {
    key += "|";
    for (const double x : *list) key += fmt::format("{:a},", x);
  }
  return key;
}

// Nothing: of a table that is still to be learnt.
template <class N>
BlockFunctions<N> no_torque() {
  BlockFunctions<N> none;
  none.torque = [](const auto*, const auto&, Balance, const auto&, auto*) {};
  none.torque_of_plain = [](const auto*, const auto&, Balance, const auto&, auto*) {};
  return none;
}

class NoTorque final : public Instance {
  void evaluate_ahead(const effects::Inputs<Real>&, const effects::Inputs<Real>&,
                      effects::Torques<Real>&) const override {}
  void advance(const effects::Inputs<Real>&, const effects::Inputs<Real>&) override {}
};

template <class N>
BlockFunctions<N> with_stated(const BlockFunctions<N>& base, const std::vector<double>& stated) {
  using P = typename N::Parameter;
  const std::vector<P> all(stated.begin(), stated.end());
  BlockFunctions<N> functions;
  functions.torque = [all, torque = base.torque](const P*, const DriveConstants<P>& drive, Balance balance,
                                                 std::span<const effects::Inputs<N>> inputs, typename N::Value* sum) {
    torque(all.data(), drive, balance, inputs, sum);
  };
  functions.torque_of_plain = [all, torque = base.torque_of_plain](
                                  const P*, const DriveConstants<P>& drive, Balance balance, const PlainInputs& inputs,
                                  typename N::Value* sum) { torque(all.data(), drive, balance, inputs, sum); };
  return functions;
}

// The signals that hold a balance's direction.
unsigned motion_on(Balance balance) {
  return balance == Balance::motor  ? effects::kMotorMotion | effects::kDirection
         : balance == Balance::load ? effects::kOutputMotion
                                    : effects::kTorsion;
}

void make_table(UserDefinedEntry& defined) {
  const Definition& d = defined.definition;
  const Entry& base = *find_user_defined(kTableEffect);
  const effects::VariableInfo& variable = *find_variable(d.variable);
  defined.info = *base.info;
  defined.info.reads = variable.reads | (d.times_direction ? motion_on(balance_named(d.balance)) : 0U);
  defined.equation = fmt::format("f({}){}", d.variable, d.times_direction ? " s(w)" : "");
  defined.info.shows_over = variable.name;
  defined.entry.label = fmt::format("{}:{}{}", kTableEffect, d.variable, d.times_direction ? "*direction" : "");
  if (d.table.value.empty()) {
    defined.entry.real = no_torque<Real>();
    defined.entry.dual = no_torque<Dual>();
    defined.entry.make = [](const double*, const DriveConstants<double>&) -> std::unique_ptr<Instance> {
      return std::make_unique<NoTorque>();
    };
    return;
  }
  const std::vector<double> stated = table_parameters(d);
  defined.entry.real = with_stated(base.real, stated);
  defined.entry.dual = with_stated(base.dual, stated);
  defined.entry.make = [stated, make = base.make](const double*, const DriveConstants<double>& drive) {
    return make(stated.data(), drive);
  };
}

std::optional<Objection> objection_to_table(const Definition& d) {
  const effects::VariableInfo* variable = find_variable(d.variable);
  if (!variable) {
    std::vector<std::string_view> names;
    for (const effects::VariableInfo& v : effects::kVariables) names.push_back(v.name);
    const std::string meant = text::nearest(d.variable, names);
    return Objection{
        "variable", fmt::format("there is no signal \"{}\"", d.variable),
        meant.empty() ? fmt::format("signals are {}", variable_names()) : fmt::format("did you mean \"{}\"?", meant)};
  }
  const std::vector<double>& at = d.table.at;
  if (at.empty()) return std::nullopt;
  if (at.size() < kFewestPoints || at.size() > kMostPoints)
    return Objection{"table", fmt::format("the table has {} points", at.size()),
                     fmt::format("give {} to {}", kFewestPoints, kMostPoints)};
  const std::vector<double> even =
      variable->periodic ? points_of_turn(at.size()) : even_points(at.front(), at.back(), at.size());
  const double step = even[1] - even[0];
  for (std::size_t k = 0; k < at.size(); ++k)
    if (!(step > 0.0) || std::abs(at[k] - even[k]) > kUneven * step)
      return Objection{"table",
                       fmt::format("point {} of the table is at {:.9g}, and even steps would have it at {:.9g}", k + 1,
                                   at[k], even[k]),
                       variable->periodic ? "points of an angle divide a turn evenly, from 0 on: at = [0, 1.5708, "
                                            "3.14159, 4.71239] are four"
                                          : "write points that rise in even steps"};
  return std::nullopt;
}

}  // namespace

std::vector<double> table_parameters(const Definition& d) {
  const Entry& base = *find_user_defined(kTableEffect);
  std::vector<double> all(base.parameters.size(), 0.0);
  all[base.index_of("variable")] = static_cast<double>(find_variable(d.variable)->variable);
  all[base.index_of("balance")] = static_cast<double>(balance_named(d.balance));
  all[base.index_of("times_direction")] = d.times_direction ? 1.0 : 0.0;
  all[base.index_of("points")] = static_cast<double>(d.table.value.size());
  all[base.index_of("from")] = d.table.at.front();
  all[base.index_of("to")] = d.table.at.back();
  std::copy(d.table.value.begin(), d.table.value.end(),
            all.begin() + static_cast<std::ptrdiff_t>(base.index_of("value")));
  return all;
}

const effects::Description* description_of(std::string_view name) {
  if (name == kExpressionEffect) return &kExpression;
  const Entry* entry = find_user_defined(name);
  return entry ? entry->info : nullptr;
}

const Entry& entry_of(const model::Effect& effect) {
  if (!effect.definition) return get(effect.type);
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<UserDefinedEntry>> entries;
  const std::string key = key_of(effect);
  {
    const std::lock_guard lock(mutex);
    if (const auto found = entries.find(key); found != entries.end()) return found->second->entry;
  }
  if (const auto objection = objection_to(effect))
    throw model::ModelError(fmt::format("{}: {}; {}", effect.id, objection->what, objection->remedy));
  auto defined = std::make_unique<UserDefinedEntry>();
  defined->definition = *effect.definition;
  if (effect.type == kTableEffect)
    make_table(*defined);
  else
    make_formula(*defined, effect);
  defined->info.balance = balance_named(effect.definition->balance);
  defined->info.adds_to = 0;
  defined->info.equation = defined->equation;
  defined->entry.info = &defined->info;
  defined->entry.definition = &defined->definition;
  const std::lock_guard lock(mutex);
  defined->entry.id = kFirstId + entries.size();
  return entries.emplace(key, std::move(defined)).first->second->entry;
}

std::optional<Objection> objection_to(const model::Effect& effect) {
  return effect.type == kTableEffect ? objection_to_table(*effect.definition) : objection_to_formula(effect);
}

std::vector<std::string> missing_values(const model::Effect& effect) {
  std::vector<std::string> missing;
  const Entry& entry = entry_of(effect);
  for (const auto& info : entry.parameters) {
    const model::Parameter* p = effect.find(info.name);
    if (!p || !p->value) missing.emplace_back(info.name);
  }
  if (effect.type == kTableEffect && effect.definition->table.value.empty()) missing.emplace_back("table");
  return missing;
}

const effects::VariableInfo* find_variable(std::string_view name) {
  for (const effects::VariableInfo& v : effects::kVariables)
    if (v.name == name) return &v;
  return nullptr;
}

std::string variable_names() {
  std::string names;
  for (const effects::VariableInfo& v : effects::kVariables)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", v.name);
  return names;
}

std::vector<double> even_points(double low, double high, std::size_t count) {
  std::vector<double> points(count, low);
  for (std::size_t k = 1; k < count; ++k)
    points[k] = low + (high - low) * static_cast<double>(k) / static_cast<double>(count - 1);
  return points;
}

std::vector<double> points_of_turn(std::size_t count) {
  std::vector<double> points(count);
  for (std::size_t k = 0; k < count; ++k) points[k] = kTurn * static_cast<double>(k) / static_cast<double>(count);
  return points;
}

}  // namespace flexspline::catalogue
