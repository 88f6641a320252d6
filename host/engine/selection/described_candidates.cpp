#include "host/engine/selection/described_candidates.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/standard_intervals.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/detection_limit.hpp"

namespace flexspline::selection {

using estimation::Term;

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
