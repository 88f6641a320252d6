#include "host/engine/selection/decision.hpp"

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

}  // namespace

std::vector<FoundTerm> decide(const Stability& stability, const SelectionPolicy& policy) {
  std::vector<FoundTerm> all;
  std::set<std::string> taken;
  // Most subsamples abstain: nothing is above the noise.
  if (stability.abstained > policy.most_abstaining * stability.subsamples) return all;
  const auto find = [&](const std::string& name) {
    return std::find_if(stability.frequencies.begin(), stability.frequencies.end(),
                        [&](const Frequency& f) { return f.name == name; });
  };
  // What is chosen first most often leads, so that a term that can take the place of a larger one is in its group.
  std::vector<Frequency> leads = stability.frequencies;
  std::stable_sort(leads.begin(), leads.end(),
                   [](const Frequency& a, const Frequency& b) { return a.first > b.first; });
  for (const Frequency& lead : leads) {
    if (taken.count(lead.name) != 0 || lead.near < policy.named_frequency ||
        lead.frequency < policy.least_own_frequency)
      continue;
    FoundTerm found;
    found.group.push_back(lead);
    found.frequency = lead.frequency;
    found.share = lead.share;
    for (const auto& [name, often] : lead.alternatives) {
      if (often < policy.group_frequency || taken.count(name) != 0) continue;
      const auto other = find(name);
      if (other == stability.frequencies.end()) continue;
      found.group.push_back(*other);
      found.frequency += other->frequency;
    }
    // A placebo wave that does as well shows that no order is identifiable here. Where the leading term is not a wave,
    // this refutes the waves only.
    if (lead.entry && !lead.order && lead.frequency >= policy.named_frequency &&
        std::any_of(found.group.begin(), found.group.end(), is_placebo)) {
      // The subsamples that chose a wave chose it for what it shares with the leading term.
      std::erase_if(found.group, [](const Frequency& f) { return f.order.has_value(); });
    }
    found.frequency = std::min(found.frequency, lead.near);
    if (found.frequency < policy.named_frequency) continue;
    for (const Frequency& f : found.group) {
      taken.insert(f.name);
      if (!f.entry && f.name != kPresliding) found.in_catalogue = false;
    }
    all.push_back(std::move(found));
  }
  const bool unknown = std::any_of(all.begin(), all.end(), [](const FoundTerm& f) { return !f.in_catalogue; });
  std::erase_if(
      all, [&](const FoundTerm& f) { return f.in_catalogue && f.frequency < least_frequency(f, unknown, policy); });
  // Waves that take off no more than a placebo wave found with them are not more significant than that.
  double placebo_share = 0.0;
  for (const FoundTerm& f : all)
    if (is_placebo(f.group.front())) placebo_share = std::max(placebo_share, f.share);
  std::erase_if(all, [&](const FoundTerm& f) {
    return f.in_catalogue && f.group.front().order && f.share < policy.similar_left * placebo_share;
  });
  std::stable_sort(all.begin(), all.end(), [](const FoundTerm& a, const FoundTerm& b) { return a.share > b.share; });
  return all;
}

}  // namespace flexspline::selection
