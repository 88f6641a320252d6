#include "host/engine/selection/add.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "host/common/algebra/root_mean_square.hpp"
#include "host/engine/comparison/noise_floor.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/standard_intervals.hpp"
#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/held_out.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::selection {
namespace {

using estimation::Balance;
using estimation::Identification;
using estimation::RegressionProblem;

// The balance on which an effect shows: its own, or the motor's where there is no torque sensor.
const std::size_t* find_balance(const Identification& fitted, Balance own, std::size_t& found) {
  const Balance balance = fitted.prepared.output_signals.torque ? own : Balance::motor;
  for (std::size_t b = 0; b < fitted.data.size(); ++b)
    if (fitted.data[b].balance() == balance) {
      found = b;
      return &found;
    }
  return nullptr;
}

// Of the data that the models are evaluated on; where these show none, of those that were fitted.
comparison::NoiseFloor floor_of(const Identification& found, const RegressionProblem& fitted_data,
                                const std::vector<const data::Experiment*>& fitted,
                                const RegressionProblem& evaluated_data,
                                const std::vector<const data::Experiment*>& evaluated) {
  const auto of = [&](const RegressionProblem& data, const std::vector<const data::Experiment*>& experiments) {
    return comparison::pooled(comparison::noise_floors(data, found.terms, experiments, found.model.drive),
                              data.records());
  };
  const comparison::NoiseFloor floor = of(evaluated_data, evaluated);
  return floor.rmse || &evaluated_data == &fitted_data ? floor : of(fitted_data, fitted);
}

std::string reversals_are_evaluated(const Addition& change) {
  return fmt::format(
      "samples around reversals of the motor count, too, as presliding shows there: on the same samples the error "
      "was {:.4g} {} and is {:.4g} {}; models without such a law are else evaluated without them",
      change.before.rmse_holdout.value_or(change.before.rmse_fit), change.unit,
      change.after.rmse_holdout.value_or(change.after.rmse_fit), change.unit);
}

// Nothing; or the interval, "0.08 to 36 N*m", of a parameter that the data determine to less than its own size.
std::optional<std::string> wide_interval(const estimation::Estimate& e) {
  if (e.fixed) return std::nullopt;
  if (!e.identifiable || !e.low || !e.high) return "none";
  if (*e.high - *e.low <= 2.0 * std::abs(e.value)) return std::nullopt;
  return fmt::format("{:.3g} to {:.3g} {}", *e.low, *e.high, e.unit);
}

// Parameters that the data determine without the effect, and hardly with it.
void warn_of_undetermined(const std::vector<estimation::Estimate>& before, Addition& change) {
  for (const estimation::Estimate& e : change.estimates) {
    const auto was = std::ranges::find_if(
        before, [&](const estimation::Estimate& b) { return b.id == e.id && b.parameter == e.parameter; });
    const std::optional<std::string> wide = wide_interval(e);
    if (!wide || was == before.end() || was->fixed || wide_interval(*was)) continue;
    change.warnings.push_back(fmt::format(
        "these data determine {}.{} without {} ({:.3g} to {:.3g} {}) but hardly with it (95 % interval: {}), as the "
        "two "
        "look much alike in them: fix the parameter in the model file if it is known, or record other motions "
        "(`flexspline plan` designs them)",
        e.id, e.parameter, change.effect, *was->low, *was->high, e.unit, *wide));
  }
}

Addition compare_models(const data::Dataset& dataset, const model::Model& before, const model::Model& after,
                        Balance own, std::string effect, std::string action,
                        const estimation::PipelineOptions& stated) {
  Addition result;
  // Both are evaluated on the same samples.
  estimation::PipelineOptions options = stated;
  options.keep_motor_reversals = estimation::has_presliding(before) || estimation::has_presliding(after);
  result.effect = std::move(effect);
  std::unique_ptr<Identification> both[2];
  estimation::in_parallel(
      2, [&](std::size_t i) { both[i] = estimation::identify(dataset, i == 0 ? before : after, options); });
  const auto& [base, extended] = both;
  estimation::count_biases(*extended, dataset, after, options);
  std::size_t b = 0, x = 0;
  if (!find_balance(*base, own, b) || !find_balance(*extended, own, x))
    throw data::DataError({{data::Severity::error, "missing_column", "", 0, "",
                            fmt::format("these data hold nothing that would show {}", result.effect),
                            fmt::format("see `flexspline effects {}` for what to record",
                                        result.effect.substr(0, result.effect.find(':')))}});
  const Balance balance = base->data[b].balance();
  result.signal = std::string(balance_signal(balance));
  result.unit = before.drive.axis == data::Axis::linear ? "N" : "N*m";
  result.before.rmse_fit = algebra::root_mean_square(base->data[b].residual(base->terms));
  result.after.rmse_fit = algebra::root_mean_square(extended->data[x].residual(extended->terms));
  const HeldOut holdout(dataset, *base, balance, options.ready.get());
  std::vector<const data::Experiment*> fitted, evaluated;
  for (const data::Experiment& e : dataset.experiments)
    if (e.role == data::Role::fit) fitted.push_back(&e);
  const RegressionProblem* evaluated_on = &extended->data[x];
  if (holdout.data) {
    result.before.rmse_holdout = holdout.rmse(base->terms);
    result.after.rmse_holdout = holdout.rmse(extended->terms);
    evaluated_on = holdout.data.get();
    evaluated = holdout.experiments;
  } else {
    evaluated = fitted;
  }
  const comparison::NoiseFloor floor = floor_of(*extended, extended->data[x], fitted, *evaluated_on, evaluated);
  result.noise_floor = floor.rmse;
  result.noise_floor_from = floor.from;
  result.model = extended->model;
  result.model.history.push_back({action, result.effect, result.before.rmse_holdout.value_or(result.before.rmse_fit),
                                  result.after.rmse_holdout.value_or(result.after.rmse_fit)});
  result.estimates = extended->estimates;
  result.tables = extended->tables;
  result.warnings = extended->warnings;
  if (action == "add") warn_of_undetermined(base->estimates, result);
  if (options.mask && balance == Balance::motor &&
      estimation::has_presliding(before) != estimation::has_presliding(after))
    result.warnings.push_back(reversals_are_evaluated(result));
  if (action == "add" && result.before.rmse_holdout && *result.after.rmse_holdout >= *result.before.rmse_holdout)
    result.warnings.push_back(fmt::format(
        "the error on held-out data did not decrease: {} does not hold beyond the data that it was fitted on",
        result.effect));
  return result;
}

}  // namespace

std::string_view balance_signal(Balance balance) {
  switch (balance) {
    case Balance::motor:
      return "motor_balance";
    case Balance::transmission:
      return "transmission_balance";
    case Balance::load:
      return "load_balance";
  }
  return "";
}

EffectName parse_effect(std::string_view text) {
  const std::size_t colon = text.find(':');
  EffectName name;
  name.entry = catalogue::find(text.substr(0, colon));
  if (!name.entry)
    throw model::ModelError(
        fmt::format("there is no effect named \"{}\"; `flexspline effects` lists them", text.substr(0, colon)));
  const auto given = std::find_if(name.entry->parameters.begin(), name.entry->parameters.end(),
                                  [](const auto& p) { return p.kind == effects::Kind::given; });
  const bool ordered = given != name.entry->parameters.end();
  if (colon == std::string_view::npos) {
    if (ordered)
      throw model::ModelError(fmt::format("{} needs its order per motor turn; write {}:2, for example", text, text));
    return name;
  }
  const std::string_view order = text.substr(colon + 1);
  double value = 0.0;
  const auto parsed = std::from_chars(order.data(), order.data() + order.size(), value);
  if (!ordered) throw model::ModelError(fmt::format("{} has no order; leave out \":{}\"", name.entry->name(), order));
  if (parsed.ec != std::errc() || parsed.ptr != order.data() + order.size() ||
      !(value >= given->low && value <= given->high))
    throw model::ModelError(fmt::format("\"{}\" is no order; write a number from {:g} to {:g}, as in {}:2", order,
                                        given->low, given->high, name.entry->name()));
  name.order = value;
  return name;
}

model::Model with_effect(const model::Model& model, const EffectName& name) {
  const estimation::Terms terms = estimation::terms_of(model);
  const estimation::Terms extended = extend(terms, *name.entry, name.order);  // checks that it may be added
  model::Model after = model;
  std::erase_if(after.effects, [&](const model::Effect& e) {
    return std::none_of(extended.begin(), extended.end(), [&](const estimation::Term& t) { return t.id == e.id; });
  });
  model::Effect added = catalogue::blank_effect(*name.entry, model.drive.axis);
  added.id = extended.back().id;
  if (name.order)
    for (std::size_t p = 0; p < added.parameters.size(); ++p)
      if (name.entry->parameters[p].kind == effects::Kind::given) added.parameters[p].value = name.order;
  after.effects.push_back(std::move(added));
  return after;
}

Addition add(const data::Dataset& dataset, const model::Model& model, std::string_view effect,
             const estimation::PipelineOptions& options, const UserDefinition& given) {
  if (names_user_defined_effect(effect)) {
    model::Model after = model;
    model::Effect added = user_defined_effect(effect, given, model);
    // A table has its points from the data before it is refitted with the rest.
    if (added.type == catalogue::kTableEffect)
      added.definition->table = learn(*estimation::identify(dataset, model, options), added, given).table;
    const Balance own = catalogue::entry_of(added).identified_on();
    after.effects.push_back(std::move(added));
    return compare_models(dataset, model, after, own, std::string(effect), "add", options);
  }
  const EffectName name = parse_effect(effect);
  const model::Model after = with_effect(model, name);
  return compare_models(dataset, model, after, name.entry->identified_on(), std::string(effect), "add", options);
}

Addition remove(const data::Dataset& dataset, const model::Model& model, std::string_view id,
                const estimation::PipelineOptions& options) {
  const model::Effect* found = model.find(id);
  if (!found && names_user_defined_effect(id)) {
    for (const model::Effect& e : model.effects)
      if (e.definition && (estimation::term_of(e).label() == id || e.type == id)) found = &e;
  } else if (!found) {
    const EffectName name = parse_effect(id);
    for (const model::Effect& e : model.effects)
      if (estimation::term_of(e).label() ==
          (name.order ? fmt::format("{}:{:g}", name.entry->name(), *name.order) : std::string(id)))
        found = &e;
  }
  if (!found) {
    std::string known;
    for (const model::Effect& e : model.effects) known += (known.empty() ? "" : ", ") + e.id;
    throw model::ModelError(fmt::format("the model has no effect \"{}\"; it has {}", id, known));
  }
  const std::string out = found->id;
  const catalogue::Entry& entry = catalogue::entry_of(*found);
  for (const model::Effect& e : model.effects)
    if (catalogue::entry_of(e).info->modulates == entry.name() && e.id != out)
      throw model::ModelError(fmt::format("{} scales {}; remove {} first", e.id, out, e.id));
  model::Model after = model;
  std::erase_if(after.effects, [&](const model::Effect& e) { return e.id == out; });
  return compare_models(dataset, model, after, entry.identified_on(), out, "remove", options);
}

}  // namespace flexspline::selection
