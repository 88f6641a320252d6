#include "host/engine/selection/between_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/meta_regression.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

using estimation::BalanceData;
using estimation::Estimate;
using estimation::RowRange;
using estimation::Term;

// What each record says of the model's friction.
struct RecordFriction {
  std::vector<const Estimate*> parameters;
  std::vector<RowRange> records;
  RecordParameters values;
};

RecordFriction friction_by_record(const estimation::Identification& base, const BalanceData& data) {
  RecordFriction friction;
  for (const Estimate& e : base.estimates) {
    const catalogue::Entry& entry = *base.terms[e.ref.term].entry;
    if (entry.info->balance != data.balance() || entry.info->surface.empty() || e.fixed || e.per_experiment.empty())
      continue;
    if (entry.parameters[e.ref.parameter].kind == effects::Kind::linear) friction.parameters.push_back(&e);
  }
  const auto parameters = static_cast<Eigen::Index>(friction.parameters.size());
  const auto most = static_cast<Eigen::Index>(data.records().size());
  auto& [theta, variance] = friction.values;
  theta.resize(most, parameters);
  variance.resize(most, parameters);
  for (const RowRange& range : data.records()) {
    const estimation::Record& record = base.prepared.records[range.record];
    const auto row = static_cast<Eigen::Index>(friction.records.size());
    bool known = !record.at_rest;
    for (Eigen::Index j = 0; known && j < parameters; ++j) {
      const auto& values = friction.parameters[static_cast<std::size_t>(j)]->per_experiment;
      const auto at = std::find_if(values.begin(), values.end(), [&](const auto& v) { return v.name == record.name; });
      known = at != values.end() && at->value && at->std;
      if (!known) break;
      theta(row, j) = *at->value;
      variance(row, j) = *at->std * *at->std;
    }
    if (known) friction.records.push_back(range);
  }
  theta.conservativeResize(static_cast<Eigen::Index>(friction.records.size()), parameters);
  variance.conservativeResize(theta.rows(), parameters);
  return friction;
}

// A law at one value of its nonlinear parameters: what it adds to the friction of each record.
struct Law {
  const CandidateFit* candidate;
  std::vector<double> values;  // of all its parameters, those that scale the torque at their usual ones
  Eigen::MatrixXd added;
};

// The friction that the model takes for the law in each record; nothing where more of the law's torque is left in a
// record than a term needs to be chosen there: then the records show it themselves.
std::optional<Eigen::MatrixXd> as_friction(BalanceData& data, const estimation::Terms& base, const RecordFriction& own,
                                           const Eigen::VectorXd& torque, const Eigen::VectorXd& root_weights) {
  std::vector<estimation::ParameterRef> refs;
  for (const Estimate* e : own.parameters) refs.push_back(e->ref);
  const Eigen::MatrixXd columns = estimation::columns_of(data, base, refs);
  Eigen::MatrixXd added(own.values.theta.rows(), own.values.theta.cols());
  for (std::size_t i = 0; i < own.records.size(); ++i) {
    const RowRange& range = own.records[i];
    const Eigen::VectorXd weights = root_weights.segment(range.first, range.size());
    const Eigen::VectorXd here = torque.segment(range.first, range.size());
    const Eigen::MatrixXd friction = columns.middleRows(range.first, range.size());
    const estimation::LinearFit fit = estimation::least_squares(friction, here, weights);
    const double left = weights.cwiseProduct(here - friction * fit.theta).squaredNorm();
    if (!(left <= kPolicy.line_share * weights.cwiseProduct(here).squaredNorm())) return std::nullopt;
    added.row(static_cast<Eigen::Index>(i)) = fit.theta.transpose();
  }
  return added;
}

std::vector<Law> laws(const estimation::Identification& base, const SearchedBalance& motor, const RecordFriction& own) {
  BalanceData data = *motor.search.data;
  std::vector<Law> all;
  for (const CandidateFit& candidate : motor.candidates) {
    estimation::Terms terms = candidate.model.terms;
    Term& law = terms.back();
    std::vector<std::size_t> nonlinear;
    for (std::size_t p = 0; p < law.values.size(); ++p) {
      if (law.free_nonlinear(p)) nonlinear.push_back(p);
      if (law.free_linear(p)) law.values[p] = law.entry->parameters[p].usual;
    }
    // An order over the angle averages out over a record.
    if (candidate.model.order || law.entry->count(effects::Kind::linear) == 0 || nonlinear.size() > 1) continue;
    std::vector<double> grid{0.0};
    if (!nonlinear.empty())
      grid = estimation::parameter_grid(estimation::parameter_range(data, law, nonlinear[0]), kGridPoints);
    for (const double value : grid) {
      if (!nonlinear.empty()) law.values[nonlinear[0]] = value;
      const Eigen::VectorXd torque = data.term_torque(terms, terms.size() - 1);
      if (auto added = as_friction(data, base.terms, own, torque, motor.search.base.root_weights))
        all.push_back({&candidate, law.values, std::move(*added)});
    }
  }
  return all;
}

// The best values of each law that the sign of friction allows, likeliest law first; of a family the first.
std::vector<std::pair<MetaRegression, const Law*>> possible(const RecordFriction& own, const std::vector<Law>& laws) {
  std::vector<std::pair<MetaRegression, const Law*>> best;
  for (const Law& law : laws) {
    MetaRegression fit = meta_regression(own.values, law.added);
    if (!is_possible(fit)) continue;
    const effects::Description& info = *law.candidate->model.entry->info;
    const auto same = std::find_if(best.begin(), best.end(), [&](const auto& other) {
      const effects::Description& its = *other.second->candidate->model.entry->info;
      return its.name == info.name || (!info.family.empty() && its.family == info.family);
    });
    if (same == best.end())
      best.emplace_back(std::move(fit), &law);
    else if (fit.likelihood_ratio > same->first.likelihood_ratio)
      *same = {std::move(fit), &law};
  }
  std::stable_sort(best.begin(), best.end(),
                   [](const auto& a, const auto& b) { return a.first.likelihood_ratio > b.first.likelihood_ratio; });
  return best;
}

// The candidate's values as the records' friction gives them; the interval is that of a factor on all that scale it.
void take_values(const MetaRegression& fit, const Law& law, double p_value, std::size_t records, Candidate& candidate) {
  const Term& term = law.candidate->model.terms.back();
  std::vector<double> values = law.values;
  for (std::size_t p = 0; p < values.size(); ++p)
    if (term.free_linear(p)) values[p] *= fit.coefficient;
  const std::vector<double> natural = catalogue::natural(*term.entry, values);
  for (Estimate& e : candidate.parameters) {
    e.value = natural[e.ref.parameter];
    e.std = e.low = e.high = std::nullopt;
    if (!term.free_linear(e.ref.parameter)) continue;
    e.std = std::abs(e.value) * fit.coefficient_std / fit.coefficient;
    e.low = e.value - 1.96 * *e.std;
    e.high = e.value + 1.96 * *e.std;
  }
  candidate.admissible = true;
  candidate.why_not.clear();
  candidate.p_value = p_value;
  candidate.note = fmt::format(
      "Found between records: it explains {:.0f} % of the variance of their friction ({} records, p = {:.2g}). Its "
      "values "
      "are those for that. Within a record the model's own friction fits as well, and differs for other reasons, too: "
      "one record with many speeds would decide.",
      100.0 * fit.explained_share, records, p_value);
}

}  // namespace

void name_between_records(const estimation::Identification& base, const SearchedBalance& motor, Diagnosis& result) {
  if (!result.named.empty() || result.friction_drift.empty()) return;
  const RecordFriction own = friction_by_record(base, *motor.search.data);
  if (own.parameters.empty() || own.records.size() < kPolicy.fewest_of_trend) return;
  const std::vector<Law> all = laws(base, motor, own);
  const auto best = possible(own, all);
  if (best.empty()) return;
  std::vector<Eigen::MatrixXd> added;
  for (const Law& law : all) added.push_back(law.added);
  // So many that the limit is twenty permutations, known to a fifth.
  const auto permutations = static_cast<int>(20.0 / kPolicy.trend_p_value);
  const double p_value = permutation_p_value(own.values, added, permutations, 1);
  if (p_value > kPolicy.trend_p_value) return;
  for (const auto& [fit, law] : best) {
    if (fit.likelihood_ratio < best.front().first.likelihood_ratio - kPolicy.confounded_margin) break;
    const std::string name(law->candidate->model.entry->name());
    const auto at = std::find_if(result.candidates.begin(), result.candidates.end(), [&](const Candidate& c) {
      return c.effect == name && !c.order && c.balance == estimation::Balance::motor;
    });
    if (at == result.candidates.end()) continue;
    take_values(fit, *law, p_value, own.records.size(), *at);
    const auto front = result.candidates.begin() + std::ssize(result.named);
    std::rotate(front, at, at + 1);
    result.named.push_back({name, std::nullopt});
  }
  if (result.named.empty()) return;
  result.verdict = result.named.size() > 1 ? Verdict::confusable_effects : Verdict::missing_effect;
  result.balance = estimation::Balance::motor;
  result.partial = true;
  result.between_records = {own.records.size(), 100.0 * best.front().first.explained_share, p_value};
}

}  // namespace flexspline::selection
