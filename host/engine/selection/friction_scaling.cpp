#include "host/engine/selection/friction_scaling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/selection/meta_regression.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/record_laws.hpp"
#include "host/engine/selection/wald_test.hpp"
#include "host/engine/selection/within_records.hpp"

namespace flexspline::selection {
namespace {

using estimation::Estimate;
using estimation::Record;
using estimation::RegressionProblem;

// An effect that scales a friction of the model, and how the records' friction goes with it.
struct Scaling {
  const CandidateFit* candidate;
  MetaRegression fit;
  double p_value;  // for one effect alone, and for the sign that physics gives it
};

bool is_scaling(const catalogue::Entry& entry) {
  return entry.info->phase == effects::Phase::modulate && (entry.info->reads & effects::kTemperature) != 0 &&
         entry.parameters.size() == 1;
}

// What a unit of the effect's parameter adds to first order, about zero, with the friction of the base fit.
Eigen::VectorXd slope_of(const RegressionProblem& data, const estimation::Terms& base, const CandidateFit& candidate) {
  estimation::Terms terms = candidate.model.terms;
  terms.back().values[0] = 0.0;
  for (estimation::Term& term : terms)
    for (const estimation::Term& fitted : base)
      if (term.id == fitted.id) term.values = fitted.values;
  const auto on_balance = estimation::terms_on(terms, data.balance(), data.prepared().output_signals);
  return data.nonlinear_columns(terms, on_balance, {{terms.size() - 1, 0}});
}

std::vector<Scaling> scalings(const estimation::Identification& base, const RegressionProblem& data,
                              const std::vector<CandidateFit>& candidates, const RecordFriction& own) {
  std::vector<Scaling> all;
  const Eigen::VectorXd weights = Eigen::VectorXd::Ones(data.rows());
  for (const CandidateFit& candidate : candidates) {
    const catalogue::Entry& entry = *candidate.model.entry;
    if (!is_scaling(entry)) continue;
    RecordSubset part{every_record(own.values).records, {}};
    for (std::size_t j = 0; j < own.parameters.size(); ++j)
      if (base.terms[own.parameters[j]->ref.term].entry->name() == entry.info->modulates)
        part.parameters.push_back(static_cast<Eigen::Index>(j));
    if (part.parameters.empty()) continue;
    const AsFriction added = as_friction(data, base.terms, own, slope_of(data, base.terms, candidate), weights);
    Scaling one{&candidate, meta_regression(part(own.values), part(added.added)), 1.0};
    const effects::ParameterInfo& info = entry.parameters.front();
    if (one.fit.freedom > 0.0 && one.fit.coefficient * info.usual > 0.0 &&
        one.fit.coefficient < kPolicy.scaling_over_range * info.high)
      one.p_value = numbers::student_t_above(one.fit.freedom, std::abs(one.fit.t));
    all.push_back(std::move(one));
  }
  return all;
}

// Whether the effect, at its value on all data, explains more within records too, where each has parameters of its own:
// significantly in all of them together, for all `tried` effects, and in none significantly less.
bool is_shown_within_records(const estimation::Identification& base, const RegressionProblem& data,
                             const CandidateFit& candidate, std::size_t tried) {
  // The model's own parameters alone are free.
  const std::vector<estimation::ParameterRef> refs = estimation::free_linear_parameters(
      base.terms, estimation::terms_on(base.terms, data.balance(), data.prepared().output_signals));
  estimation::Terms extended = base.terms;
  extended.push_back(candidate.fit.terms.back());
  const WithinRecords within = compare_within_records(data.target(), data.columns(base.terms, refs),
                                                      data.columns(extended, refs), data.records());
  const double p_value = numbers::chi_squared_above(1.0, std::max(0.0, within.deviance));
  return static_cast<double>(tried) * p_value <= kPolicy.scaling_p_value &&
         within.least > -numbers::chi_squared_quantile(1.0, 0.95);
}

// By chance, in one of the effects that were tried.
double p_value_of_all(const Scaling& one, const std::vector<Scaling>& all) {
  return std::min(1.0, static_cast<double>(all.size()) * one.p_value);
}

void list_as_possible(const NamedEffect& name, const std::string& why, Diagnosis& result) {
  std::erase_if(result.possible, [&](const PossibleEffect& p) {
    return std::any_of(p.group.begin(), p.group.end(), [&](const NamedEffect& n) { return n.effect == name.effect; });
  });
  result.possible.push_back({{name}, why, std::nullopt, std::nullopt});
}

std::string chance_between_records(std::size_t records, double p_value) {
  return fmt::format(
      "it shows between records only, and friction of {} records depends on it by chance with p = {:.2g}", records,
      p_value);
}

// Lists the effect that explains most of how three records differ: a line through three has one degree of freedom
// left, and none through two.
void list_of_few_records(const estimation::Identification& base, const RegressionProblem& data,
                         const std::vector<CandidateFit>& candidates, Diagnosis& result) {
  const RecordFriction own = friction_by_record(base, data, 3);
  if (own.parameters.empty() || own.records.size() < 3 || own.records.size() >= kPolicy.fewest_of_scaling) return;
  const std::vector<Scaling> all = scalings(base, data, candidates, own);
  const auto best = std::max_element(all.begin(), all.end(), [](const Scaling& a, const Scaling& b) {
    return a.fit.explained_share < b.fit.explained_share;
  });
  if (best == all.end() || best->fit.explained_share < kPolicy.most_share) return;
  const catalogue::Entry& entry = *best->candidate->model.entry;
  if (best->fit.coefficient * entry.parameters.front().usual <= 0.0) return;
  const NamedEffect name{std::string(entry.name()), std::nullopt};
  if (std::any_of(result.named.begin(), result.named.end(),
                  [&](const NamedEffect& n) { return n.effect == name.effect; }))
    return;
  list_as_possible(
      name,
      fmt::format("it explains {:.0f} % of how the friction of {} records differs, and {} records are needed",
                  100.0 * best->fit.explained_share, own.records.size(), kPolicy.fewest_of_scaling),
      result);
}

// The candidate's value is that of the records' friction.
void take_value(const Scaling& one, std::size_t records, double p_value, Candidate& candidate) {
  for (Estimate& e : candidate.parameters) {
    const effects::ParameterInfo& info = one.candidate->model.entry->parameters[e.ref.parameter];
    e.value = std::clamp(one.fit.coefficient, info.low, info.high);
    e.std = std::abs(one.fit.coefficient / one.fit.t);
    const double reach = numbers::student_t_quantile(one.fit.freedom, 0.975) * *e.std;
    e.low = e.value - reach;
    e.high = e.value + reach;
  }
  candidate.admit();
  candidate.p_value = p_value;
  candidate.note = fmt::format(
      "Found between records: friction of {} records depends on it (t = {:.3g}, {:.0f} degrees of freedom, p = "
      "{:.2g}). "
      "What else changed from record to record, such as wear-in over time, would look the same: repeat one motion cold "
      "and warm to make sure.",
      records, one.fit.t, one.fit.freedom, p_value);
}

const RegressionProblem& motor_balance_of(const estimation::Identification& base) {
  return *std::find_if(base.data.begin(), base.data.end(),
                       [](const RegressionProblem& d) { return d.balance() == estimation::Balance::motor; });
}

// Share of the variance of the temperature that is within records.
double share_within_records(const RegressionProblem& data) {
  double within = 0.0, sum = 0.0, squares = 0.0, count = 0.0;
  for (const estimation::RowRange& range : data.records()) {
    const Record& r = data.prepared().records[range.record];
    if (!r.has_temperature || r.at_rest) continue;
    double own_sum = 0.0, own_squares = 0.0;
    const auto n = static_cast<double>(r.inputs.size());
    for (std::size_t k = 0; k < r.inputs.size(); ++k) {
      const double t = r.inputs.temperature_at(k);
      own_sum += t;
      own_squares += t * t;
    }
    within += own_squares - own_sum * own_sum / n;
    sum += own_sum;
    squares += own_squares;
    count += n;
  }
  const double all = squares - sum * sum / std::max(count, 1.0);
  return all > 0.0 ? within / all : 1.0;
}

}  // namespace

std::unique_ptr<AllRecords> fit_all_records(const SearchedBalance& motor, const data::Dataset& dataset,
                                            const model::Model& model, estimation::PipelineOptions pipeline) {
  const bool any_scaling = std::any_of(motor.candidates.begin(), motor.candidates.end(),
                                       [](const CandidateFit& t) { return is_scaling(*t.model.entry); });
  const bool any_held_out = std::any_of(dataset.experiments.begin(), dataset.experiments.end(),
                                        [](const data::Experiment& e) { return e.role == data::Role::holdout; });
  if (!any_scaling || !any_held_out) return nullptr;
  auto all = std::make_unique<AllRecords>();
  all->dataset = dataset;
  for (data::Experiment& e : all->dataset.experiments)
    if (e.role == data::Role::holdout) e.role = data::Role::fit;
  pipeline.ready = nullptr;  // those of `dataset` itself
  all->fitted = estimation::identify(all->dataset, model, pipeline);
  return all;
}

namespace {

std::size_t records_in_motion(const RegressionProblem& data) {
  return static_cast<std::size_t>(
      std::count_if(data.records().begin(), data.records().end(),
                    [&](const estimation::RowRange& range) { return !data.prepared().records[range.record].at_rest; }));
}

// The candidate whose likelihood with random effects says that friction goes with it, although too few records identify
// a friction of their own; null: none does.
const CandidateFit* likely_scaling(const SearchedBalance& motor) {
  const auto is_likely = [](const CandidateFit& t) {
    if (!is_scaling(*t.model.entry) || !passes(t)) return false;
    return t.fit.terms.back().values.front() * t.model.entry->parameters.front().usual > 0.0;
  };
  const CandidateFit* best = nullptr;
  for (const CandidateFit& t : motor.candidates)
    if (is_likely(t) && (best == nullptr || t.gain.score > best->gain.score)) best = &t;
  return best;
}

using Candidates = std::vector<Candidate>;

// On the motor's balance; the end of the list: it is not there.
Candidates::iterator candidate_of_effect(std::string_view effect, Diagnosis& result) {
  return std::ranges::find_if(result.candidates, [&](const Candidate& c) {
    return c.effect == effect && c.balance == estimation::Balance::motor;
  });
}

// Puts an effect, whose candidate has its values, behind those that are named.
void name_it(Candidates::iterator candidate, const BetweenRecords& evidence, Diagnosis& result) {
  const NamedEffect name{candidate->effect, std::nullopt};
  std::erase_if(result.possible, [&](const PossibleEffect& p) { return p.group.front().effect == name.effect; });
  std::rotate(result.candidates.begin() + std::ssize(result.named), candidate, candidate + 1);
  result.named.push_back(name);
  result.verdict = Verdict::missing_effect;
  result.balance = estimation::Balance::motor;
  result.partial = true;
  result.between_records = evidence;
}

bool name_likely_scaling(const SearchedBalance& motor, Diagnosis& result) {
  const std::size_t records = records_in_motion(*motor.search.data);
  const CandidateFit* const likely = likely_scaling(motor);
  if (likely == nullptr || records < kPolicy.fewest_of_scaling || !result.named.empty()) return false;
  const auto tried = static_cast<double>(
      std::ranges::count_if(motor.candidates, [](const CandidateFit& t) { return is_scaling(*t.model.entry); }));
  const double p_value = std::min(1.0, tried * p_value_of_likelihood(likely->gain.score, records));
  const auto at = candidate_of_effect(likely->model.entry->name(), result);
  if (p_value > kPolicy.scaling_p_value || at == result.candidates.end()) return false;
  at->admit();
  at->p_value = p_value;
  at->note = fmt::format(
      "Found between records, by the likelihood of all {} (p = {:.2g}). What else changed from record to record, such "
      "as wear-in over time, would look the same: repeat one motion cold and warm to make sure.",
      records, p_value);
  name_it(at, {records, likely->gain.fixed_effects_percent, p_value}, result);
  return true;
}

}  // namespace

double p_value_of_likelihood(double likelihood_ratio, std::size_t records) {
  if (records < 3 || !(likelihood_ratio > 0.0)) return 1.0;
  const auto n = static_cast<double>(records);
  const double t = std::sqrt((n - 2.0) * std::expm1(likelihood_ratio / n));
  return numbers::student_t_above(n - 2.0, t);
}

bool name_scaling(const estimation::Identification& base, const SearchedBalance& motor, Diagnosis& result) {
  const RegressionProblem& data = motor_balance_of(base);
  const RecordFriction own = friction_by_record(base, data, kPolicy.fewest_of_scaling);
  if (own.parameters.empty()) {
    list_of_few_records(base, data, motor.candidates, result);
    return name_likely_scaling(motor, result);
  }
  const std::vector<Scaling> all = scalings(base, data, motor.candidates, own);
  const auto best = std::min_element(all.begin(), all.end(),
                                     [](const Scaling& a, const Scaling& b) { return a.p_value < b.p_value; });
  if (best == all.end() || p_value_of_all(*best, all) > kPolicy.wald_p_value) return name_likely_scaling(motor, result);
  const double p_value = p_value_of_all(*best, all);
  const NamedEffect name{std::string(best->candidate->model.entry->name()), std::nullopt};
  if (std::any_of(result.named.begin(), result.named.end(),
                  [&](const NamedEffect& n) { return n.effect == name.effect; }))
    return false;
  const auto at = candidate_of_effect(name.effect, result);
  if (at == result.candidates.end()) return false;
  const std::size_t records = own.records.size();
  if (p_value > kPolicy.scaling_p_value) {
    if (name_likely_scaling(motor, result)) return true;
    list_as_possible(name, chance_between_records(records, p_value), result);
    return false;
  }
  take_value(*best, records, p_value, *at);
  name_it(at, {records, 100.0 * best->fit.explained_share, p_value}, result);
  return true;
}

bool is_shown_between_records(std::size_t records, double p_value, bool held_out_confirms) {
  if (p_value <= kPolicy.wald_p_value) return true;
  return records < kPolicy.fewest_of_scaling && held_out_confirms;
}

void take_back_unconfirmed_scaling(const estimation::Identification& base, const SearchedBalance& motor,
                                   Diagnosis& result) {
  const auto is_scaled = [](const NamedEffect& n) { return !n.order && is_scaling(catalogue::get(n.effect)); };
  if (result.verdict == Verdict::confusable_effects ||
      std::none_of(result.named.begin(), result.named.end(), is_scaled) ||
      share_within_records(*motor.search.data) > kPolicy.shown_within_records)
    return;
  const RegressionProblem& data = motor_balance_of(base);
  const RecordFriction own = friction_by_record(base, data, 1);
  const std::vector<Scaling> all = scalings(base, data, motor.candidates, own);
  std::vector<NamedEffect> kept;
  for (const NamedEffect& n : result.named) {
    const auto at = std::find_if(all.begin(), all.end(),
                                 [&](const Scaling& s) { return s.candidate->model.entry->name() == n.effect; });
    if (!is_scaled(n) || at == all.end() || is_shown_within_records(base, data, *at->candidate, all.size()) ||
        is_shown_between_records(own.records.size(), p_value_of_all(*at, all), is_confirmed_by_held_out(result, n)))
      kept.push_back(n);
    else
      list_as_possible(n, chance_between_records(own.records.size(), p_value_of_all(*at, all)), result);
  }
  result.named = std::move(kept);
}

}  // namespace flexspline::selection
