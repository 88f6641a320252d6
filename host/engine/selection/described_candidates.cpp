#include "host/engine/selection/described_candidates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/standard_intervals.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/detection_limit.hpp"

namespace flexspline::selection {

using estimation::Term;

namespace {

// Error of a nonlinear parameter, in the unit in which users read it: that of its shift in the linearised fit, and the
// shift itself, by which the search has missed the best value. Nothing where it was not free, or is not determined.
std::optional<double> nonlinear_std(const CandidateFit& candidate, const RegressionProblem& data,
                                    const estimation::ParameterRef& ref) {
  const estimation::Terms& terms = candidate.fit.terms;
  const auto on_balance = estimation::terms_on(terms, data.balance(), data.prepared().output_signals);
  const std::vector<estimation::ParameterRef> free = estimation::free_nonlinear_parameters(terms, on_balance);
  const auto at = std::ranges::find(free, ref);
  const auto shift = static_cast<Eigen::Index>(candidate.fit.linear.size()) + (at - free.begin());
  if (at == free.end() || shift >= candidate.fit.std.size()) return std::nullopt;
  const double std = std::hypot(candidate.fit.std[shift], candidate.fit.theta[shift]);
  const Term& term = terms[ref.term];
  std::vector<double> moved = term.values;
  const double step = 1e-6 * std::max(std::abs(moved[ref.parameter]), 1e-12);
  moved[ref.parameter] += step;
  const double slope = (catalogue::natural(*term.entry, moved)[ref.parameter] -
                        catalogue::natural(*term.entry, term.values)[ref.parameter]) /
                       step;
  return std::isfinite(std * slope) ? std::optional(std::abs(std * slope)) : std::nullopt;
}

}  // namespace

void set_std(estimation::Estimate& e, double std, const effects::ParameterInfo& info) {
  e.std = std;
  const estimation::Interval interval = estimation::interval_95(e.value, std);
  e.low = std::max(interval.low, std::min(info.low, e.value));
  e.high = std::min(interval.high, std::max(info.high, e.value));
}

Candidate candidate_of(const CandidateFit& candidate, const BalanceSearch& search, data::Axis axis) {
  Candidate c;
  c.effect = std::string(candidate.model.entry->name());
  c.order = candidate.model.order;
  c.balance = search.data->balance();
  c.score = candidate.gain.score;
  c.other_balance_score = candidate.other_balance_score;
  c.chi2_decrease_percent = candidate.gain.chi2_percent;
  c.rmse_cv_before = search.base.rmse_cv_fixed_effects();
  c.rmse_cv_after = candidate.fit.rmse_cv_fixed_effects();
  c.p_value = candidate.gain.p_value;
  c.admissible = candidate.admissible;
  c.why_not = candidate.why_not;
  if (!candidate.confounded_with.empty()) c.cannot_distinguish.push_back(candidate.confounded_with);
  const effects::Description& info = *candidate.model.entry->info;
  if (is_another_law(candidate, *search.data))
    c.note = fmt::format("Both amplitudes are negative over a wide range of speed: {}.", info.wide_negative_means);
  else if (is_negative(candidate))
    c.note = fmt::format("Both amplitudes are negative: {}.", info.negative_means);
  if (!candidate.note.empty()) c.note = candidate.note;
  const std::size_t added = candidate.fit.terms.size() - 1;
  const Term& term = candidate.fit.terms[added];
  const std::vector<double> natural = catalogue::natural(*term.entry, term.values);
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    estimation::Estimate e;
    e.ref = {added, p};
    e.id = term.id;
    e.effect = std::string(term.entry->name());
    e.parameter = std::string(term.entry->parameters[p].name);
    e.unit = std::string(catalogue::unit_on(term.entry->parameters[p].unit, axis));
    e.value = natural[p];
    e.fixed = term.known[p] != 0;
    if (const auto at = position(candidate.fit, e.id, e.parameter)) {
      e.std = candidate.fit.std[static_cast<Eigen::Index>(*at)];
      const estimation::Interval interval = estimation::interval_95(e.value, *e.std);
      e.low = interval.low;
      e.high = interval.high;
    } else if (const auto std = nonlinear_std(candidate, *search.data, e.ref)) {
      set_std(e, *std, term.entry->parameters[p]);
    }
    c.parameters.push_back(std::move(e));
  }
  return c;
}

void explain_orders(const model::Drive& drive, Diagnosis& result) {
  for (Candidate& c : result.candidates) {
    const catalogue::Entry* entry = catalogue::find(c.effect);
    if (!c.order || entry == nullptr) continue;
    c.order_causes = catalogue::order_causes(*entry, *c.order, drive);
    c.order_hint = catalogue::order_hint(*entry, drive);
  }
}

void list_candidates(std::vector<SearchedBalance>& all, data::Axis axis, Diagnosis& result) {
  for (SearchedBalance& e : all) {
    const DetectionLimit detection(e.search);
    std::vector<std::optional<Detectable>> smallest(e.candidates.size());
    estimation::in_parallel(e.candidates.size(),
                            [&](std::size_t i) { smallest[i] = detection.smallest(e.candidates[i]); });
    for (std::size_t i = 0; i < e.candidates.size(); ++i) {
      const CandidateFit& t = e.candidates[i];
      result.candidates.push_back(candidate_of(t, e.search, axis));
      result.candidates.back().minimum_detectable = std::move(smallest[i]);
      if (!t.confounded_with.empty())
        result.candidates.back().confounding_reasons.push_back(compare_with_model(e.search, t));
    }
  }
  std::stable_sort(result.candidates.begin(), result.candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.admissible != b.admissible ? a.admissible
                                        : a.score + a.other_balance_score > b.score + b.other_balance_score;
  });
}

}  // namespace flexspline::selection
