#include "host/engine/selection/resampling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/selection/frequent_groups.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/stability_selection.hpp"

namespace flexspline::selection {

namespace {

std::vector<Resampling::Support> support_of(const StabilitySelection& selection, const estimation::Terms& terms) {
  std::vector<Resampling::Support> all;
  const auto near = [&](const std::string& name) {
    for (const Frequency& f : selection.result().frequencies)
      if (f.name == name) return f.near;
    return 0.0;
  };
  for (const CandidateTerm& term : selection.tables().table.terms) {
    if (!term.entry || selection.is_left_out(term.name)) continue;
    const bool is_there = std::any_of(all.begin(), all.end(), [&](const Resampling::Support& s) {
      return s.effect == term.entry->name() && s.order == term.order;
    });
    if (!is_there) all.push_back({std::string(term.entry->name()), term.order, near(term.name)});
  }
  for (const auto& [entry, order] : selection.tables().table.smaller_waves)
    all.push_back({std::string(entry->name()), order, 0.0});
  for (const catalogue::Entry* entry : selection.tables().table.not_visible)
    all.push_back({std::string(entry->name()), std::nullopt, 0.0});
  if (const catalogue::Entry* law = presliding_law(terms);
      law && selection.tables().table.presliding && !selection.is_left_out(kPresliding))
    all.push_back({std::string(law->name()), std::nullopt, near(kPresliding)});
  return all;
}

std::vector<std::string> first_names(const std::vector<FoundTerm>& decided) {
  std::vector<std::string> names;
  for (const FoundTerm& found : decided) names.push_back(found.group.front().name);
  return names;
}

Resampling::FoundTerm found_term(const FoundTerm& found, std::optional<double> held_out_ratio,
                                 const estimation::Terms& terms) {
  Resampling::FoundTerm one;
  for (const Frequency& f : found.group) one.name += (one.name.empty() ? "" : " or ") + f.name;
  one.frequency = found.frequency;
  one.least_by_mask = found.least_by_mask;
  one.share_percent = 100.0 * found.share;
  one.share_low_percent = 100.0 * found.group.front().share_low;
  one.share_high_percent = 100.0 * found.group.front().share_high;
  one.held_out_ratio = held_out_ratio;
  if (found.in_catalogue)
    for (const Frequency& f : found.group) {
      const catalogue::Entry* entry = f.name == kPresliding ? presliding_law(terms) : f.entry;
      if (entry) one.group.push_back({std::string(entry->name()), f.order});
    }
  one.refused_by_holdout =
      !one.group.empty() && one.held_out_ratio && *one.held_out_ratio > kPolicy.most_held_out_ratio;
  return one;
}

// What the subsamples chose, with its error on experiments that are held out.
void find_terms(const StabilitySelection& selection, const estimation::Terms& terms, Resampling& result) {
  const std::vector<FoundTerm> decided = frequent_groups(selection.result(), kPolicy);
  const std::vector<double> held_out = selection.held_out_ratios(first_names(decided));
  for (std::size_t i = 0; i < decided.size(); ++i)
    result.found.push_back(found_term(decided[i], held_out.empty() ? std::nullopt : std::optional(held_out[i]), terms));
  for (const FoundTerm& one : undecided(selection.result(), decided, kPolicy)) {
    std::vector<std::string> names = first_names(decided);
    names.push_back(one.group.front().name);
    const std::vector<double> with_it = selection.held_out_ratios(names);
    const Resampling::FoundTerm term =
        found_term(one, with_it.empty() ? std::nullopt : std::optional(with_it.back()), terms);
    const bool is_found =
        (term.frequency >= kPolicy.named_frequency ? term.is_strongly_confirmed() : term.is_most_of_held_out_error()) &&
        term.least_by_mask >= 1.0 - kPolicy.named_frequency;
    (is_found ? result.found : result.undecided).push_back(term);
  }
}

// Presliding whose travel is not resolved may be an axis that sticks. Chooses again without it, unless nearly all
// subsamples have it and the held-out error falls by as much as an effect that matters.
void leave_out_sticking(StabilitySelection& selection, const estimation::Terms& terms, Resampling& result) {
  if (selection.tables().presliding_is_resolved) return;
  const auto is_presliding = [](const Resampling::FoundTerm& f) {
    return !f.group.empty() && catalogue::get(f.group.front().effect).is_presliding();
  };
  const auto found = std::find_if(result.found.begin(), result.found.end(), is_presliding);
  if (found == result.found.end()) return;
  if (found->frequency >= kPolicy.certain_frequency && found->is_strongly_confirmed()) return;
  Resampling::FoundTerm sticking = *found;
  sticking.may_be_sticking = true;
  selection.leave_out({kPresliding});
  result.found.clear();
  result.undecided.clear();
  find_terms(selection, terms, result);
  result.undecided.push_back(std::move(sticking));
}

// A term that the held-out error refuses takes the place of what is there: chooses again without such terms. What is
// found then has to be confirmed by the held-out error.
void find_instead_of_refused(StabilitySelection& selection, const estimation::Terms& terms, Resampling& result) {
  std::vector<Resampling::FoundTerm> refused;
  std::vector<std::string> names;
  const std::vector<FoundTerm> decided = frequent_groups(selection.result(), kPolicy);
  for (std::size_t i = 0; i < decided.size(); ++i) {
    if (!result.found[i].refused_by_holdout) continue;
    refused.push_back(result.found[i]);
    for (const Frequency& f : decided[i].group) names.push_back(f.name);
  }
  if (names.empty()) return;
  selection.leave_out(names);
  result.found.clear();
  std::erase_if(result.undecided, [](const Resampling::FoundTerm& f) { return !f.may_be_sticking; });
  find_terms(selection, terms, result);
  for (Resampling::FoundTerm& f : result.found) f.is_second_choice = true;
  result.found.insert(result.found.end(), refused.begin(), refused.end());
}

}  // namespace

Resampling resample(const std::vector<const data::Experiment*>& experiments, const model::Drive& drive,
                    const estimation::Terms& terms) {
  StabilitySelection selection(experiments, drive, terms, estimation::Balance::motor, kPolicy);
  const Stability& stability = selection.result();
  Resampling result;
  if (const std::optional<TimeLag> lag = selection.time_lag(first_names(frequent_groups(stability, kPolicy)))) {
    selection.correct_lag(*lag);
    result.lag_s = lag->lag_s;
    result.lag_std_s = lag->std_s;
  }
  result.torque_has_noise = selection.tables().torque_has_noise;
  result.highest_hz = selection.tables().bandwidth.highest_hz;
  result.lowest_hz =
      result.highest_hz * std::pow(kPolicy.bandwidth_factor, static_cast<double>(kPolicy.bandwidths - 1));
  find_terms(selection, terms, result);
  leave_out_sticking(selection, terms, result);
  result.support = support_of(selection, terms);
  for (const catalogue::Entry* entry : selection.tables().table.not_visible)
    result.not_visible.emplace_back(entry->name());
  find_instead_of_refused(selection, terms, result);
  result.subsamples = stability.subsamples;
  result.too_little = stability.subsamples == 0.0 && selection.tables().table.model_columns > 0;
  result.abstained = stability.abstained;
  result.von_neumann_ratio = stability.von_neumann_ratio;
  return result;
}

bool Resampling::FoundTerm::is_strongly_confirmed() const {
  return held_out_ratio && *held_out_ratio * *held_out_ratio <= 1.0 - kPolicy.matters_share;
}

bool Resampling::FoundTerm::is_most_of_held_out_error() const {
  return held_out_ratio && *held_out_ratio * *held_out_ratio <= 1.0 - kPolicy.most_share;
}

bool Resampling::FoundTerm::is_confirmed() const {
  return held_out_ratio && *held_out_ratio * *held_out_ratio <= 1.0 - kPolicy.line_share;
}

bool Resampling::FoundTerm::is_unknown_structure() const {
  if (!group.empty() || refused_by_holdout) return false;
  return held_out_ratio ? *held_out_ratio * *held_out_ratio <= 1.0 - kPolicy.law_share
                        : frequency >= kPolicy.certain_frequency;
}

std::vector<NamedEffect> Resampling::found_group(const NamedEffect& name) const {
  for (const FoundTerm& one : found)
    for (const NamedEffect& n : one.group)
      if (n == name) return one.group;
  return {};
}

bool Resampling::is_visible(std::string_view effect) const {
  return std::find(not_visible.begin(), not_visible.end(), effect) == not_visible.end();
}

}  // namespace flexspline::selection
