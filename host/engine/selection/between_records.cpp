#include "host/engine/selection/between_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/selection/friction_scaling.hpp"
#include "host/engine/selection/meta_regression.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/record_laws.hpp"

namespace flexspline::selection {
namespace {

using estimation::Estimate;
using estimation::Term;

using Possible = std::vector<std::pair<MetaRegression, const Law*>>;

// The best values of each law that the sign of friction allows in these records, likeliest law first; of a family the
// first.
Possible possible(const RecordFriction& own, const std::vector<Law>& laws, const RecordSubset& part) {
  Possible best;
  const RecordParameters values = part(own.values);
  for (const Law& law : laws) {
    MetaRegression fit = meta_regression(values, part(law.added));
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
  if (best.empty()) return best;
  const double least = best.front().first.likelihood_ratio - kPolicy.confounded_margin;
  std::erase_if(best, [&](const auto& b) { return b.first.likelihood_ratio < least; });
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
    // Of as few records the variance is uncertain, too (Knapp and Hartung 2003).
    e.std = std::abs(e.value / fit.t);
    const double reach = numbers::student_t_quantile(fit.freedom, 0.975) * *e.std;
    e.low = e.value - reach;
    e.high = e.value + reach;
  }
  candidate.admit();
  candidate.p_value = p_value;
  candidate.note = fmt::format(
      "Found between records: it explains {:.0f} % of the variance of their friction ({} records, p = {:.2g}). Its "
      "values are those for that. Within a record the model's own friction fits as well, and differs for other "
      "reasons, too: "
      "one record with many speeds would decide.",
      100.0 * fit.explained_share, records, p_value);
}

void name_likeliest(const Possible& best, double p_value, std::size_t records, Diagnosis& result) {
  for (const auto& [fit, law] : best) {
    const std::string name(law->candidate->model.entry->name());
    const auto at = std::find_if(result.candidates.begin(), result.candidates.end(), [&](const Candidate& c) {
      return c.effect == name && !c.order && c.balance == estimation::Balance::motor;
    });
    if (at == result.candidates.end()) continue;
    take_values(fit, *law, p_value, records, *at);
    const auto front = result.candidates.begin() + std::ssize(result.named);
    std::rotate(front, at, at + 1);
    result.named.push_back({name, std::nullopt});
  }
  if (result.named.empty()) return;
  result.verdict = result.named.size() > 1 ? Verdict::confusable_effects : Verdict::missing_effect;
  result.balance = estimation::Balance::motor;
  result.partial = true;
  result.between_records = {records, 100.0 * best.front().first.explained_share, p_value};
}

// The range of speeds in which a law explains friction best, where chance seldom does as well in any of them.
std::optional<LawInRange> law_in_range(const estimation::Identification& base, const RecordFriction& own,
                                       const std::vector<Law>& laws, const std::vector<Eigen::MatrixXd>& added) {
  std::vector<double> speeds;
  for (const estimation::RowRange& range : own.records)
    speeds.push_back(rms_speed(base.prepared.records[range.record]));
  const std::vector<RecordSubset> ranges = ranges_of_speed(own, speeds);
  const RecordSubset* chosen = nullptr;
  Possible best;
  for (const RecordSubset& range : ranges)
    if (Possible here = possible(own, laws, range);
        !here.empty() && (!chosen || here.front().first.likelihood_ratio > best.front().first.likelihood_ratio)) {
      chosen = &range;
      best = std::move(here);
    }
  if (!chosen) return std::nullopt;
  LawInRange found;
  found.p_value = permutation_p_value(own.values, added, ranges, static_cast<int>(20.0 / kPolicy.range_p_value), 1);
  if (found.p_value > kPolicy.range_p_value) return std::nullopt;
  for (const auto& [fit, law] : best) found.effects.emplace_back(law->candidate->model.entry->name());
  found.records = chosen->records.size();
  found.of_records = own.records.size();
  found.explained_percent = 100.0 * best.front().first.explained_share;
  found.lowest_speed = speeds[static_cast<std::size_t>(chosen->records.front())];
  found.highest_speed = speeds[static_cast<std::size_t>(chosen->records.back())];
  found.speed_unit = base.prepared.rotary ? "rad/s" : "m/s";
  return found;
}

}  // namespace

void name_between_records(const estimation::Identification& base, const estimation::Identification& all_records,
                          const SearchedBalance& motor, Diagnosis& result) {
  if (result.friction_drift.empty() || result.verdict == Verdict::confusable_effects) return;
  if (name_scaling(all_records, motor, result) || !result.named.empty()) return;
  const RecordFriction own = friction_by_record(base, *motor.search.data, kPolicy.fewest_of_trend);
  if (own.parameters.empty() || own.records.size() < kPolicy.fewest_of_trend) return;
  const std::vector<Law> all = laws(base, motor, own);
  std::vector<Eigen::MatrixXd> added;
  for (const Law& law : all) added.push_back(law.added);
  const RecordSubset whole = every_record(own.values);
  // So many that the limit is twenty permutations, known to a fifth.
  const auto permutations = static_cast<int>(20.0 / kPolicy.trend_p_value);
  const double p_value = permutation_p_value(own.values, added, {whole}, permutations, 1);
  if (p_value <= kPolicy.trend_p_value)
    return name_likeliest(possible(own, all, whole), p_value, own.records.size(), result);
  result.law_in_range = law_in_range(base, own, all, added);
  if (result.law_in_range) result.law_in_range->p_value_of_all = p_value;
}

}  // namespace flexspline::selection
