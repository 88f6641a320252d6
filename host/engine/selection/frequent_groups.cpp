#include "host/engine/selection/frequent_groups.hpp"

#include <algorithm>
#include <set>

namespace flexspline::selection {

namespace {

// A wave of an order that no drive has.
bool is_placebo(const Frequency& f) {
  return !f.entry && f.order;
}

// Behind a structure that is in no catalogue, and for a term with a small share, the limit is stricter.
double least_frequency(const FoundTerm& found, bool unknown, const SelectionPolicy& policy) {
  const bool behind_unknown = unknown && found.group.front().first < policy.group_frequency;
  const bool strict = behind_unknown || found.share < policy.line_share;
  return strict && found.group.front().name != kPresliding ? policy.certain_frequency : policy.named_frequency;
}

// Waves that take off less than twice what a placebo wave found with them does are not more significant than that.
bool is_near_placebo(const FoundTerm& term, const std::vector<FoundTerm>& found, const SelectionPolicy& policy) {
  double placebo_share = 0.0;
  for (const FoundTerm& f : found)
    if (is_placebo(f.group.front())) placebo_share = std::max(placebo_share, f.share);
  return term.in_catalogue && term.group.front().order && term.share < policy.similar_left * placebo_share;
}

bool has_unknown(const std::vector<FoundTerm>& found) {
  return std::any_of(found.begin(), found.end(), [](const FoundTerm& f) { return !f.in_catalogue; });
}

// A placebo wave that does as well shows that no order is identifiable here. Where an effect that is no wave was chosen
// `least` often, or was nearly as good as what was, this refutes the waves only: they were chosen for what they share
// with that effect, which has fewer parameters. Returns the names of the waves.
std::vector<std::string> leave_out_waves(double least, std::vector<Frequency>& group) {
  if (std::none_of(group.begin(), group.end(), is_placebo)) return {};
  const auto is_other = [&](const Frequency& f) { return f.entry && !f.order && f.near >= least; };
  if (std::none_of(group.begin(), group.end(), is_other)) return {};
  std::vector<std::string> waves;
  for (const Frequency& f : group)
    if (f.order) waves.push_back(f.name);
  std::erase_if(group, [](const Frequency& f) { return f.order.has_value(); });
  std::stable_sort(group.begin(), group.end(), [](const Frequency& a, const Frequency& b) { return a.near > b.near; });
  return waves;
}

// Groups that at least `least` of the subsamples chose, without those in `taken`, to which their members are added.
std::vector<FoundTerm> groups_chosen(const Stability& stability, double least, std::set<std::string>& taken,
                                     const SelectionPolicy& policy) {
  std::vector<FoundTerm> all;
  const auto find = [&](const std::string& name) {
    return std::find_if(stability.frequencies.begin(), stability.frequencies.end(),
                        [&](const Frequency& f) { return f.name == name; });
  };
  // What is chosen first most often leads, so that a term that can take the place of a larger one is in its group.
  std::vector<Frequency> leads = stability.frequencies;
  std::stable_sort(leads.begin(), leads.end(),
                   [](const Frequency& a, const Frequency& b) { return a.first > b.first; });
  for (const Frequency& lead : leads) {
    if (taken.count(lead.name) != 0 || lead.near < least || lead.frequency < policy.least_own_frequency) continue;
    FoundTerm found;
    found.group.push_back(lead);
    found.frequency = lead.frequency;
    found.share = lead.share;
    found.least_by_mask = lead.least_near_by_mask;
    for (const auto& [name, often] : lead.alternatives) {
      if (often < policy.group_frequency || taken.count(name) != 0) continue;
      const auto other = find(name);
      if (other == stability.frequencies.end()) continue;
      found.group.push_back(*other);
      found.frequency += other->frequency;
    }
    const std::vector<std::string> refuted = leave_out_waves(least, found.group);
    found.share = found.group.front().share;
    found.frequency = std::min(found.frequency, lead.near);
    if (found.frequency < least) continue;
    taken.insert(refuted.begin(), refuted.end());
    for (const Frequency& f : found.group) {
      taken.insert(f.name);
      if (!f.entry && f.name != kPresliding) found.in_catalogue = false;
    }
    all.push_back(std::move(found));
  }
  return all;
}

}  // namespace

std::vector<FoundTerm> frequent_groups(const Stability& stability, const SelectionPolicy& policy) {
  // Most subsamples abstain: nothing is above the noise.
  if (stability.abstained > policy.most_abstaining * stability.subsamples) return {};
  std::set<std::string> taken;
  std::vector<FoundTerm> all = groups_chosen(stability, policy.named_frequency, taken, policy);
  const bool unknown = has_unknown(all);
  // What the samples with reversals, or those without, rule out is the misfit of another law there.
  std::erase_if(all, [&](const FoundTerm& f) {
    return f.in_catalogue &&
           (f.frequency < least_frequency(f, unknown, policy) || f.least_by_mask < 1.0 - policy.named_frequency);
  });
  const std::vector<FoundTerm> with_waves = all;
  std::erase_if(all, [&](const FoundTerm& f) { return is_near_placebo(f, with_waves, policy); });
  std::stable_sort(all.begin(), all.end(), [](const FoundTerm& a, const FoundTerm& b) { return a.share > b.share; });
  return all;
}

std::vector<FoundTerm> undecided(const Stability& stability, const std::vector<FoundTerm>& found,
                                 const SelectionPolicy& policy) {
  if (stability.abstained > policy.most_abstaining * stability.subsamples) return {};
  std::set<std::string> taken;
  for (const FoundTerm& one : found)
    for (const Frequency& f : one.group) taken.insert(f.name);
  std::vector<FoundTerm> all = groups_chosen(stability, 1.0 - policy.named_frequency, taken, policy);
  std::erase_if(all, [&](const FoundTerm& term) { return !term.in_catalogue || is_near_placebo(term, found, policy); });
  std::stable_sort(all.begin(), all.end(),
                   [](const FoundTerm& a, const FoundTerm& b) { return a.frequency > b.frequency; });
  return all;
}

}  // namespace flexspline::selection
