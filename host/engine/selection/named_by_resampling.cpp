#include "host/engine/selection/named_by_resampling.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/joint_names.hpp"
#include "host/engine/selection/naming_rules.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

PossibleEffect possible(const Resampling::FoundTerm& found, std::string why) {
  return {found.group, std::move(why), found.frequency, found.held_out_ratio};
}

// The names of what was found that keep all rules, largest share first, and why the others do not.
struct RuledNames {
  std::vector<NamedEffect> names;
  bool is_group = false;  // these data cannot distinguish them
  std::vector<PossibleEffect> refused;
};

RuledNames apply_rules(const Resampling& resampling, const SearchedBalance& motor) {
  RuledNames ruled;
  for (const Resampling::FoundTerm& found : resampling.found) {
    if (found.group.empty()) continue;
    const FoundOnMotor effect{found, resampling, motor, ruled.names, ruled.is_group};
    if (const NamingRule* rule = broken_rule(effect)) {
      ruled.refused.push_back(possible(found, rule->why_not(effect)));
      continue;
    }
    ruled.is_group = found.group.size() > 1;
    ruled.names.insert(ruled.names.end(), found.group.begin(), found.group.end());
  }
  return ruled;
}

// Where no torque is known, data do not show whether the scale of the motor's torque or that of its sensor is wrong.
// Adds the other one to a name that stands alone; false: there is none to add.
bool add_other_scale(const SearchedBalance& motor, std::vector<NamedEffect>& names) {
  const auto is_scale = [](const catalogue::Entry& entry) { return (entry.info->reads & effects::kTorqueScale) != 0; };
  if (names.size() != 1 || states_a_torque(motor.search.base.terms)) return false;
  const std::string first = names.front().effect;
  if (!is_scale(catalogue::get(first))) return false;
  for (const CandidateFit& t : motor.candidates)
    if (t.model.entry->name() != first && is_scale(*t.model.entry) && passes(t)) names.push_back(name_of(t));
  return names.size() > 1;
}

// Why what fewer subsamples chose than are needed is not named.
std::string why_undecided(const Resampling::FoundTerm& term) {
  if (term.may_be_sticking)
    return "its travel is no longer than what steps and noise of the encoder hide: the axis may only stick";
  if (term.refused_by_holdout) return held_out_rise(term);
  if (term.frequency >= kPolicy.named_frequency && term.least_by_mask < 1.0 - kPolicy.named_frequency)
    return fmt::format("of those with the reversals, or of those without, only {:.0f} of 100 did",
                       100.0 * term.least_by_mask);
  return fmt::format("{:.0f} are needed, {:.0f} where it shows little or behind an unknown structure",
                     100.0 * kPolicy.named_frequency, 100.0 * kPolicy.certain_frequency);
}

// Why resampling does not name what likelihood would.
std::string why_not_chosen(const Resampling& resampling, const CandidateFit& likeliest) {
  if (likeliest.gain.chi2_percent < 100.0 * kPolicy.line_share)
    return fmt::format(
        "it explains {:.1f} % of the squared error, and {:.0f} % are needed where the noise is not known",
        likeliest.gain.chi2_percent, 100.0 * kPolicy.line_share);
  const std::optional<double> support = support_of(resampling, likeliest);
  if (!support || !resampling.is_visible(likeliest.model.entry->name()))
    return "halves of the data cannot judge it here";
  const std::string chosen = fmt::format("{:.0f} of 100 subsamples", 100.0 * *support);
  if (*support < kPolicy.named_frequency) return fmt::format("only {} chose it", chosen);
  return fmt::format("in {} something else did nearly as well", chosen);
}

// What likelihood alone would name, where it is neither named nor possible already.
std::optional<PossibleEffect> likeliest_alone(const Resampling& resampling, const SearchedBalance& motor,
                                              const std::vector<NamedEffect>& named,
                                              const std::vector<PossibleEffect>& listed) {
  if (!motor.names_one()) return std::nullopt;
  const CandidateFit& first = motor.candidates.front();
  const bool is_listed =
      std::ranges::any_of(listed, [&](const PossibleEffect& p) { return contains_family(p.group, first); });
  // Far above a known floor a small decrease of the error proves nothing.
  const bool is_small = motor.floor.rmse && first.gain.chi2_percent < 100.0 * kPolicy.line_share;
  if (contains_family(named, first) || is_listed || is_small || first.model.entry->is_presliding()) return std::nullopt;
  return PossibleEffect{{name_of(first)},
                        fmt::format("its likelihood is significant (score {:.0f}), but {}", first.gain.score,
                                    why_not_chosen(resampling, first)),
                        std::nullopt,
                        first.held_out_ratio};
}

// Groups of the catalogue that were found and are refused, or are undecided.
std::vector<PossibleEffect> possible_effects(const Resampling& resampling, const SearchedBalance& motor,
                                             RuledNames ruled) {
  std::vector<PossibleEffect> all = std::move(ruled.refused);
  for (const Resampling::FoundTerm& term : resampling.undecided)
    if (!term.group.empty()) all.push_back(possible(term, why_undecided(term)));
  std::erase_if(all, [&](const PossibleEffect& p) {
    return std::ranges::any_of(p.group, [&](const NamedEffect& n) { return contains(ruled.names, n); });
  });
  if (auto likeliest = likeliest_alone(resampling, motor, ruled.names, all)) all.push_back(std::move(*likeliest));
  return all;
}

// Of a family of laws the one that fits best with its nonlinear parameters searched continuously.
std::vector<NamedEffect> best_of_families(std::vector<NamedEffect> names, const SearchedBalance& motor) {
  for (NamedEffect& n : names) {
    const std::string_view family = catalogue::get(n.effect).info->family;
    if (family.empty()) continue;
    const CandidateFit* best = nullptr;
    for (const CandidateFit& t : motor.candidates)
      if (t.model.entry->info->family == family && t.admissible && (!best || t.gain.score > best->gain.score))
        best = &t;
    if (best) n.effect = std::string(best->model.entry->name());
  }
  return names;
}

// Takes off names that gain nothing with the others in the model. Returns whether the rest is a group.
bool name_jointly(const SearchedBalance& motor, Diagnosis& result) {
  JointNames joint = eliminate_backward(*result.resampling, motor, std::move(result.named));
  result.named = std::move(joint.names);
  std::erase_if(result.possible, [&](const PossibleEffect& p) {
    return p.group.size() == 1 && contains(result.named, p.group.front());
  });
  const auto list = [&](std::vector<NamedEffect>& names, const char* why_not) {
    for (NamedEffect& name : names) result.possible.push_back({{std::move(name)}, why_not, std::nullopt, std::nullopt});
  };
  list(joint.eliminated, "with the named effect in the model, left-out data gain nothing by it");
  list(joint.more,
       "it is missing besides what cannot be distinguished; add what is missing of that and diagnose again");
  return joint.is_group;
}

// Puts the candidates of the names first, in their order; an effect that likelihood does not judge gets one.
void list_names_first(bool is_group, Diagnosis& result) {
  std::ptrdiff_t begin = 0;
  for (const NamedEffect& n : result.named) {
    auto at = std::find_if(result.candidates.begin() + begin, result.candidates.end(),
                           [&](const Candidate& c) { return name_of(c) == n; });
    if (at == result.candidates.end()) {
      Candidate c;
      c.effect = n.effect;
      c.order = n.order;
      c.rmse_cv_before = result.base_rmse_cv;
      c.rmse_cv_after = result.base_rmse_cv;
      at = result.candidates.insert(result.candidates.end(), std::move(c));
    }
    at->admit();
    for (const NamedEffect& other : result.named)
      if (is_group && name_of(*at) != other) at->cannot_distinguish.push_back(other.effect);
    std::rotate(result.candidates.begin() + begin, at, at + 1);
    ++begin;
  }
}

}  // namespace

std::optional<double> support_of(const Resampling& resampling, const CandidateFit& candidate) {
  std::optional<double> support;
  for (const Resampling::Support& s : resampling.support)
    if (is_of_family(NamedEffect{s.effect, s.order}, candidate)) support = std::max(support.value_or(0.0), s.frequency);
  return support;
}

StableNames stable_names(const Resampling& resampling, const SearchedBalance& motor) {
  RuledNames ruled = apply_rules(resampling, motor);
  return {best_of_families(std::move(ruled.names), motor), ruled.is_group};
}

bool names_any(const Resampling& resampling, const SearchedBalance& motor) {
  return !apply_rules(resampling, motor).names.empty();
}

void name_stable(SearchedBalance& chosen, Diagnosis& result) {
  const Resampling& resampling = *result.resampling;
  RuledNames ruled = apply_rules(resampling, chosen);
  bool is_group = ruled.is_group;
  result.named = best_of_families(ruled.names, chosen);
  result.possible = possible_effects(resampling, chosen, std::move(ruled));
  if (!is_group) is_group = name_jointly(chosen, result);
  is_group = add_other_scale(chosen, result.named) || is_group;
  result.partial = std::ssize(resampling.found) > (is_group ? 1 : std::ssize(result.named));
  if (result.named.empty()) return;
  result.verdict = is_group ? Verdict::confusable_effects : Verdict::missing_effect;
  list_names_first(is_group, result);
  const auto candidate = std::ranges::find_if(
      chosen.candidates, [&](const CandidateFit& t) { return name_of(t) == result.named.front(); });
  if (candidate != chosen.candidates.end()) std::rotate(chosen.candidates.begin(), candidate, candidate + 1);
}

}  // namespace flexspline::selection
