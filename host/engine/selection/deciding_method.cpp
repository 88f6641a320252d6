#include "host/engine/selection/deciding_method.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/named_by_resampling.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

bool is_of_effort(const CandidateFit& candidate) {
  return candidate.model.entry->info->reads == effects::kCurrent;
}

bool is_of_torque(const CandidateFit& candidate) {
  return (candidate.model.entry->info->reads & effects::kTorque) != 0;
}

// Whether an effect takes off nearly all squares of the model's error; or, of what is above a known noise floor where
// the model's error is above it, all but what no term needs to take off. An effect built from the measured effort may
// explain a part of its own noise.
bool takes_off_nearly_all(const SearchedBalance& e, const CandidateFit& candidate) {
  if (candidate.gain.chi2_percent > kPolicy.nearly_all_percent) return true;
  if (!e.floor.rmse || e.search.base.rmse() < (1.0 + kPolicy.floor_uncertainty) * *e.floor.rmse) return false;
  const auto above = [&](double rmse) { return rmse * rmse - *e.floor.rmse * *e.floor.rmse; };
  return above(candidate.fit.rmse()) < kPolicy.line_share * above(e.search.base.rmse());
}

// Whether resampling found another effect that explains what is above the noise, too.
bool explains_instead(const Resampling& resampling, const CandidateFit& likeliest) {
  return std::ranges::any_of(resampling.found, [&](const Resampling::FoundTerm& f) {
    return !f.group.empty() && !f.refused_by_holdout && f.share_percent >= kPolicy.recovered_percent &&
           (f.frequency >= kPolicy.certain_frequency || f.is_strongly_confirmed()) &&
           !contains_family(f.group, likeliest);
  });
}

const CandidateFit& likeliest(const BothMethods& b) {
  return b.motor.candidates.front();
}

std::optional<double> support(const BothMethods& b) {
  return support_of(b.resampling, likeliest(b));
}

// ---- The rules

bool is_without_samples(const BothMethods& b) {
  return b.resampling.subsamples == 0.0 && !b.resampling.too_little;
}

bool has_too_few_samples(const BothMethods& b) {
  return b.resampling.subsamples == 0.0;
}

bool likelihood_names_nothing(const BothMethods& b) {
  return !b.motor.names_one();
}

// Even with it the model does not hold on data left out of the fit: what it takes off there is extrapolation.
bool likeliest_does_not_carry_over(const BothMethods& b) {
  const CrossValidatedFit& fit = likeliest(b).fit;
  return std::pow(fit.rmse_cv_fixed_effects(), 2) >
         kPolicy.max_validation_to_training * std::pow(fit.rmse_fixed_effects(), 2);
}

// The model with the likeliest effect leaves known noise: as large as a noise floor that is not from a fit, with no
// more correlation than the filter causes.
bool likeliest_reaches_floor(const BothMethods& b) {
  const SearchedBalance& e = b.motor;
  if (!e.floor.rmse || explains_instead(b.resampling, likeliest(b))) return false;
  const CrossValidatedFit& fit = likeliest(b).fit;
  return std::abs(fit.rmse() / *e.floor.rmse - 1.0) < kPolicy.floor_uncertainty &&
         fit.autocorrelation_time < (1.0 + kPolicy.filter_uncertainty) * e.search.data->filter_autocorrelation_time() &&
         (!is_of_effort(likeliest(b)) || takes_off_nearly_all(e, likeliest(b)));
}

// Likelihood leaves out reversals, where alone presliding shows.
bool likeliest_is_presliding(const BothMethods& b) {
  return likeliest(b).model.entry->is_presliding();
}

bool unseen_by_halves_takes_off_nearly_all(const BothMethods& b) {
  return !support(b) && likeliest(b).gain.chi2_percent > kPolicy.nearly_all_percent &&
         !explains_instead(b.resampling, likeliest(b));
}

bool unseen_by_halves_stands_alone(const BothMethods& b) {
  return !support(b) && stands_alone(b.resampling, b.motor.candidates);
}

// A law with memory, which halves are not offered: all that they chose are special cases of it that explain less.
bool unseen_contains_what_halves_found(const BothMethods& b) {
  const CandidateFit& best = likeliest(b);
  const auto is_contained = [&](const NamedEffect& name) {
    const CandidateFit* own = candidate_named(b.motor, name);
    return own && catalogue::names_contain(best.model.entry->info->contains, name.effect) &&
           own->gain.score + kPolicy.confounded_margin < best.gain.score;
  };
  return best.model.entry->has_state && !support(b) && !b.resampling.found.empty() &&
         std::ranges::all_of(b.resampling.found, [&](const Resampling::FoundTerm& found) {
           return !found.group.empty() && std::ranges::all_of(found.group, is_contained);
         });
}

bool halves_found_others_only(const BothMethods& b) {
  return !b.resampling.found.empty() && std::ranges::none_of(b.resampling.found, [&](const auto& found) {
    return contains_family(found.group, likeliest(b));
  });
}

bool halves_name_several(const BothMethods& b) {
  const StableNames stable = stable_names(b.resampling, b.motor);
  return stable.names.size() > 1 && !stable.is_group;
}

bool halves_did_not_choose_likeliest(const BothMethods& b) {
  const bool most_abstained = b.resampling.abstained > kPolicy.most_abstaining_to_judge * b.resampling.subsamples;
  return !most_abstained && support(b) && *support(b) < kPolicy.named_frequency;
}

// An effect built from the measured effort, or from a noisy torque, also explains its noise.
bool likeliest_may_explain_noise(const BothMethods& b) {
  return (!support(b) && is_of_effort(likeliest(b))) || (b.resampling.torque_has_noise && is_of_torque(likeliest(b)));
}

// Where more than one effect is missing, structure remains whatever is added, and a small decrease proves nothing.
// Where the noise floor is unknown, the residual must be white, of three records or more, as what is peculiar to one
// motion may be white in its own record; an effect of the effort alone is not taken, as it may explain its own noise;
// and the effect must matter, as white noise hides small other causes that it resembles (a cable that drags with the
// angle looks like a weight).
bool likeliest_leaves_noise(const BothMethods& b) {
  if (b.motor.floor.rmse) return likeliest(b).fit.rmse() < kPolicy.at_floor * *b.motor.floor.rmse;
  if (b.motor.search.data->records().size() < estimation::kFewestRecords) return false;
  return b.resampling.von_neumann_ratio >= kPolicy.white && !is_of_effort(likeliest(b)) &&
         likeliest(b).gain.chi2_percent >= 100.0 * kPolicy.line_share;
}

bool always(const BothMethods&) {
  return true;
}

constexpr auto kDecidingRules = std::to_array<DecidingRule>({
    {"nothing to resample", is_without_samples, Method::likelihood},
    {"too few samples for halves", has_too_few_samples, Method::resampling},
    {"likelihood names nothing", likelihood_names_nothing, Method::resampling},
    {"the model does not hold on data left out", likeliest_does_not_carry_over, Method::resampling},
    {"the likeliest effect reaches the noise floor", likeliest_reaches_floor, Method::likelihood},
    {"the likeliest effect is presliding", likeliest_is_presliding, Method::resampling},
    {"halves cannot choose it, and it explains nearly all", unseen_by_halves_takes_off_nearly_all, Method::likelihood},
    {"halves cannot choose it, and find nothing", unseen_by_halves_stands_alone, Method::likelihood},
    {"halves cannot choose it, and it contains what they found", unseen_contains_what_halves_found, Method::likelihood},
    {"halves found other effects only", halves_found_others_only, Method::resampling},
    {"halves name several effects", halves_name_several, Method::resampling},
    {"halves did not choose the likeliest effect", halves_did_not_choose_likeliest, Method::resampling},
    {"the likeliest effect may explain noise of its signal", likeliest_may_explain_noise, Method::resampling},
    {"the likeliest effect leaves noise", likeliest_leaves_noise, Method::likelihood},
    {"structure remains", always, Method::resampling},
});

}  // namespace

std::span<const DecidingRule> deciding_rules() {
  return kDecidingRules;
}

Method deciding_method(const Resampling& resampling, const SearchedBalance& motor) {
  const BothMethods both{resampling, motor};
  return std::ranges::find_if(kDecidingRules, [&](const DecidingRule& rule) { return rule.applies(both); })->decides;
}

bool stands_alone(const Resampling& resampling, std::span<const CandidateFit> candidates) {
  const CandidateFit& likeliest = candidates.front();
  if (!resampling.found.empty() || likeliest.gain.chi2_percent < 100.0 * kPolicy.most_share) return false;
  if (likeliest.held_out_ratio && likeliest.shows_held_out)
    return 1.0 - std::pow(*likeliest.held_out_ratio, 2) >= kPolicy.matters_share;
  return std::ranges::none_of(candidates.subspan(1), explains_a_part);
}

}  // namespace flexspline::selection
