#include "host/engine/estimation/terms.hpp"

#include <fmt/format.h>

#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::estimation {

using effects::Kind;

std::string Term::label() const {
  if (!entry->label.empty()) return entry->label;
  for (std::size_t p = 0; p < entry->parameters.size(); ++p)
    if (entry->parameters[p].kind == Kind::given) return fmt::format("{}:{:g}", entry->name(), values[p]);
  return std::string(entry->name());
}

bool changes_inputs_of(const Term& changer, const Term& term) {
  const effects::Description& what = *changer.entry->info;
  // The torque of a kinematic error follows from the measured torque.
  if (what.phase == effects::Phase::shift)
    return (term.entry->info->reads & effects::kTorsion) != 0 && term.entry->info->phase == effects::Phase::source;
  // An effect that replaces another one is scaled like it.
  if (what.phase == effects::Phase::modulate)
    return catalogue::names_contain(what.modulates, term.entry->name()) ||
           catalogue::names_contain(term.entry->info->replaces, what.modulates);
  return false;
}

Term term_of(const model::Effect& effect) {
  Term term;
  term.entry = &catalogue::entry_of(effect);
  term.id = effect.id;
  term.values = catalogue::reduced(*term.entry, catalogue::values_of(effect, *term.entry));
  for (const auto& info : term.entry->parameters) {
    const model::Parameter* p = effect.find(info.name);
    // A ratio to a parameter without a value is undefined.
    const model::Parameter* per = info.per.empty() ? p : effect.find(info.per);
    const bool stated = p && p->value.has_value() && (info.per.empty() || (per && per->value.value_or(0.0) != 0.0));
    term.stated.push_back(stated);
    term.known.push_back(info.kind == Kind::given || info.kind == Kind::grid || (stated && p->fixed));
  }
  return term;
}

Term candidate_term(const catalogue::Entry& entry, std::optional<double> order) {
  Term term;
  term.entry = &entry;
  term.id = std::string(entry.name());
  for (const auto& info : entry.parameters) {
    const bool given = info.kind == Kind::given;
    term.values.push_back(given ? order.value_or(info.usual) : 0.0);
    term.known.push_back(given || info.kind == Kind::grid);
    term.stated.push_back(given);
  }
  return term;
}

Terms terms_of(const model::Model& model) {
  Terms terms;
  for (const model::Effect& effect : model.effects) terms.push_back(term_of(effect));
  return terms;
}

std::vector<ParameterRef> free_linear_parameters(const Terms& terms, const std::vector<std::size_t>& which) {
  std::vector<ParameterRef> refs;
  for (const std::size_t t : which)
    for (std::size_t p = 0; p < terms[t].values.size(); ++p)
      if (terms[t].free_linear(p)) refs.push_back({t, p});
  return refs;
}

std::vector<ParameterRef> free_nonlinear_parameters(const Terms& terms, const std::vector<std::size_t>& which) {
  std::vector<ParameterRef> refs;
  for (const std::size_t t : which)
    for (std::size_t p = 0; p < terms[t].values.size(); ++p)
      if (terms[t].free_nonlinear(p)) refs.push_back({t, p});
  return refs;
}

Balance identified_on(const catalogue::Entry& entry, const OutputSignals& signals) {
  if (!signals.torque) return Balance::motor;
  const Balance own = entry.identified_on();
  const bool is_of_sensor = own == Balance::transmission && entry.adds_torque() && entry.adds_to(Balance::motor) &&
                            (entry.info->reads & effects::kTorsion) == 0;
  return is_of_sensor && !signals.torsion ? Balance::motor : own;
}

std::vector<std::size_t> terms_on(const Terms& terms, Balance balance, const OutputSignals& signals) {
  std::vector<std::size_t> which;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    // Without a torque sensor the motor balance alone can be formed; effects of another one have their column there.
    if (identified_on(*terms[t].entry, signals) == balance ||
        (!signals.torque && terms[t].entry->identified_on() == balance))
      which.push_back(t);
  }
  return which;
}

std::vector<std::size_t> terms_acting_on_other_balance(const Terms& terms, Balance balance,
                                                       const OutputSignals& signals) {
  std::vector<std::size_t> which;
  if (!signals.torque) return which;
  for (std::size_t t = 0; t < terms.size(); ++t)
    if (terms[t].adds_torque() && identified_on(*terms[t].entry, signals) != balance &&
        terms[t].entry->adds_to(balance))
      which.push_back(t);
  return which;
}

}  // namespace flexspline::estimation
