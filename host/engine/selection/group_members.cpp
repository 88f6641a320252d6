#include "host/engine/selection/group_members.hpp"

#include <algorithm>
#include <cmath>

#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

void take_likelier_waves(Resampling& resampling, const SearchedBalance& motor) {
  for (Resampling::FoundTerm& found : resampling.found) {
    if (found.group.size() != 1 || !found.group.front().order) continue;
    const NamedEffect name = found.group.front();
    const CandidateFit* own = candidate_named(motor, name);
    const double own_score = own ? own->gain.score : 0.0;
    for (const std::string_view wave : catalogue::split_names(catalogue::get(name.effect).info->phase_error_of)) {
      const CandidateFit* other = candidate_named(motor, {std::string(wave), name.order});
      if (!other || !passes(*other)) continue;
      const double more = other->gain.score - own_score;
      if (more < -kPolicy.confounded_margin) continue;
      found.group = {name_of(*other)};
      if (more <= kPolicy.confounded_margin) found.group.push_back(name);
      break;
    }
  }
}

void add_identical_effects(Resampling& resampling, const SearchedBalance& motor) {
  for (Resampling::FoundTerm& found : resampling.found) {
    // Likelihood leaves out reversals, where alone presliding shows.
    if (found.group.size() != 1 || catalogue::get(found.group.front().effect).is_presliding()) continue;
    const CandidateFit* own = candidate_named(motor, found.group.front());
    if (!own) continue;
    for (const CandidateFit& t : motor.candidates)
      if (&t != own && t.admissible && is_same_function(*own, t)) found.group.push_back(name_of(t));
  }
}

void add_effects_of_angle(Resampling& resampling, const SearchedBalance& motor) {
  for (Resampling::FoundTerm& found : resampling.found) {
    const auto first =
        std::ranges::find_if(motor.candidates, [&](const CandidateFit& t) { return contains_family(found.group, t); });
    if (first == motor.candidates.end()) continue;
    for (const CandidateFit& t : motor.candidates)
      if (!contains_family(found.group, t) && is_angle_confounded(*first, t)) found.group.push_back(name_of(t));
  }
}

}  // namespace flexspline::selection
