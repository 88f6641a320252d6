#include "host/engine/selection/naming_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/record_cross_validation.hpp"

namespace flexspline::selection {
namespace {

// Whether the likelihood of all data is significant for an effect, and, where the noise is not known, the effect takes
// off as much as a term must: white noise hides small other causes that it resembles.
bool is_significant(const SearchedBalance& motor, const NamedEffect& name) {
  return std::ranges::any_of(motor.candidates, [&](const CandidateFit& candidate) {
    return is_of_family(name, candidate) && candidate.gain.score > kPolicy.named_score &&
           (motor.floor.rmse || candidate.gain.chi2_percent >= 100.0 * kPolicy.line_share);
  });
}

// Whether an effect is a wave of the output's angle, or of fewer than one a turn of the motor. Over a part of a turn
// that is an offset and a slope, which halves choose for any slow function of the angle.
bool is_of_output_angle(const NamedEffect& name) {
  return (catalogue::get(name.effect).info->reads & effects::kOutputAngle) != 0 || name.order.value_or(1.0) < 1.0;
}

// The candidate of a single effect that was found, of those that likelihood can judge: it leaves out reversals, where
// alone presliding shows. Null: there is none.
const CandidateFit* candidate_to_judge(const Resampling::FoundTerm& found, const SearchedBalance& motor) {
  if (found.group.size() != 1) return nullptr;
  const NamedEffect& name = found.group.front();
  return catalogue::get(name.effect).is_presliding() ? nullptr : candidate_named(motor, name);
}

// The effect that resampling cannot choose, that is confused with what it found, and is likelier; null: there is none.
const CandidateFit* likelier_unseen(const FoundOnMotor& e) {
  double score = kPolicy.named_score;
  for (const CandidateFit& t : e.motor.candidates)
    for (const NamedEffect& n : e.found.group) {
      // Likelihood leaves out reversals, where alone presliding shows.
      if (catalogue::get(n.effect).is_presliding()) return nullptr;
      if (is_of_family(n, t)) score = std::max(score, t.gain.score + kPolicy.confounded_margin);
    }
  const auto is_confused = [&](const catalogue::Entry& unseen) {
    return std::any_of(e.found.group.begin(), e.found.group.end(), [&](const NamedEffect& n) {
      return catalogue::names_contain(unseen.info->confused_with, n.effect) ||
             catalogue::names_contain(catalogue::get(n.effect).info->confused_with, unseen.name());
    });
  };
  for (const CandidateFit& t : e.motor.candidates)
    if (passes(t) && t.gain.score > score && !e.resampling.is_visible(t.model.entry->name()) &&
        is_confused(*t.model.entry))
      return &t;
  return nullptr;
}

// Parts of the same motions agree in what is peculiar to these.
bool has_few_records_of_unknown_noise(const SearchedBalance& motor) {
  return !motor.floor.rmse && motor.search.data->records().size() < estimation::kFewestRecords;
}

bool is_below_share_of_a_term(const Resampling::FoundTerm& found) {
  return found.share_percent < 100.0 * kPolicy.line_share;
}

std::string how_held_out_falls(const Resampling::FoundTerm& found) {
  return fmt::format("the squared error on experiments that are held out falls by {:.1f} % only",
                     100.0 * (1.0 - *found.held_out_ratio * *found.held_out_ratio));
}

constexpr std::string_view kNearNoise =
    "the model alone is near the noise in most subsamples, or in fewer than three records";

// ---- The rules

bool does_not_raise_held_out_error(const FoundOnMotor& e) {
  return !e.found.refused_by_holdout;
}
std::string raises_held_out_error(const FoundOnMotor& e) {
  return held_out_rise(e.found);
}

bool is_supported(const FoundOnMotor& e) {
  return may_be_stated(e.resampling, e.found, e.motor);
}
std::string is_not_supported(const FoundOnMotor& e) {
  if (std::ranges::any_of(e.found.group, is_of_output_angle))
    return "other functions of the output's angle look like it on these data: its likelihood would have to be "
           "significant, with 5 % of the squared error where the noise is not known, or the squared error on "
           "experiments that are held out to fall by half";
  if (e.found.held_out_ratio && !e.found.is_confirmed()) return how_held_out_falls(e.found);
  return std::string(kNearNoise);
}

// Halves of few records of unknown noise may not decide alone: where data are held out, their error has to confirm it,
// or the likelihood of all data.
bool holds_beyond_few_records(const FoundOnMotor& e) {
  if (!has_few_records_of_unknown_noise(e.motor) || !e.found.held_out_ratio || e.found.is_confirmed()) return true;
  return std::any_of(e.found.group.begin(), e.found.group.end(),
                     [&](const NamedEffect& name) { return is_significant(e.motor, name); });
}
std::string does_not_hold_beyond_few_records(const FoundOnMotor& e) {
  return how_held_out_falls(e.found) + ", and fewer than three records were fitted";
}

bool is_confirmed_where_needed(const FoundOnMotor& e) {
  return e.found.is_confirmed() || !(e.found.is_second_choice || is_within_floor_of_few_records(e.motor.search));
}
std::string is_not_confirmed(const FoundOnMotor& e) {
  if (e.found.held_out_ratio) return how_held_out_falls(e.found);
  return e.found.is_second_choice ? "it was chosen only after another one was refused, and no experiments confirm it"
                                  : std::string(kNearNoise);
}

// Stick phases, and friction of the output behind an elastic gear, look like presliding in some halves.
bool is_certain_presliding(const FoundOnMotor& e) {
  return !catalogue::get(e.found.group.front().effect).is_presliding() || e.found.is_confirmed() ||
         e.found.frequency >= kPolicy.certain_frequency;
}
std::string is_uncertain_presliding(const FoundOnMotor& e) {
  return e.found.held_out_ratio ? how_held_out_falls(e.found)
                                : fmt::format("without experiments that are held out {:.0f} of 100 are needed",
                                              100.0 * kPolicy.certain_frequency);
}

bool agrees_with_likelihood(const FoundOnMotor& e) {
  return !is_contradicted(e.found, e.motor);
}
std::string is_against_likelihood(const FoundOnMotor& e) {
  return fmt::format("with it, the likelihood of all data falls (score {:.0f})",
                     candidate_to_judge(e.found, e.motor)->gain.score);
}

// A member that is a wave of the output's angle whose period the data do not show; null: none.
const CandidateFit* of_uncertain_period(const FoundOnMotor& e) {
  for (const NamedEffect& n : e.found.group)
    if (const CandidateFit* c = candidate_named(e.motor, n); c && c->has_uncertain_period) return c;
  return nullptr;
}
bool has_certain_period(const FoundOnMotor& e) {
  return of_uncertain_period(e) == nullptr;
}
std::string has_uncertain_period(const FoundOnMotor& e) {
  return of_uncertain_period(e)->why_not;
}

bool is_likeliest_of_confused(const FoundOnMotor& e) {
  return likelier_unseen(e) == nullptr;
}
std::string another_is_likelier(const FoundOnMotor& e) {
  return fmt::format("{}, which halves of the data cannot judge here, is likelier",
                     likelier_unseen(e)->model.entry->name());
}

bool is_not_behind_group(const FoundOnMotor& e) {
  return !e.is_behind_group;
}
std::string is_behind_group(const FoundOnMotor&) {
  return "a group of effects explains more, and these data do not show which of them it is";
}

bool is_single_behind_another(const FoundOnMotor& e) {
  return e.named_before.empty() || e.found.group.size() == 1;
}
std::string is_group_behind_another(const FoundOnMotor&) {
  return "its members cannot be distinguished, and what is named explains more";
}

// Below that share it is a remainder of the first law, or not worth a parameter.
bool matters_behind_another(const FoundOnMotor& e) {
  return e.named_before.empty() || !is_below_share_of_a_term(e.found) || e.found.is_strongly_confirmed();
}
std::string is_too_small_behind_another(const FoundOnMotor& e) {
  return fmt::format(
      "it explains {:.1f} % of the squared error above the noise, and {:.0f} % are needed behind another effect",
      e.found.share_percent, 100.0 * kPolicy.line_share);
}

// A name that is not certain may be what another law leaves, or an imperfection that is in no catalogue: held-out
// experiments decide, where there are any.
bool is_certain(const FoundOnMotor& e) {
  const double least = e.named_before.empty() ? kPolicy.unconfirmed_frequency : kPolicy.certain_frequency;
  return e.found.frequency >= least || !e.found.held_out_ratio || e.found.is_confirmed();
}
std::string is_not_certain(const FoundOnMotor& e) {
  return how_held_out_falls(e.found);
}

constexpr auto kNamingRules = std::to_array<NamingRule>({
    {"held-out error does not rise", does_not_raise_held_out_error, raises_held_out_error},
    {"most subsamples, held-out error or likelihood", is_supported, is_not_supported},
    {"few records: held-out error or likelihood", holds_beyond_few_records, does_not_hold_beyond_few_records},
    {"second choice, or near the floor of few records: held-out error", is_confirmed_where_needed, is_not_confirmed},
    {"presliding: held-out error, or nearly all subsamples", is_certain_presliding, is_uncertain_presliding},
    {"the likelihood of all data does not contradict", agrees_with_likelihood, is_against_likelihood},
    {"a wave of the output's angle: the data show its period", has_certain_period, has_uncertain_period},
    {"no effect that halves cannot choose is likelier", is_likeliest_of_confused, another_is_likelier},
    {"not behind a group that the data cannot distinguish", is_not_behind_group, is_behind_group},
    {"behind another: a single effect", is_single_behind_another, is_group_behind_another},
    {"behind another: the share of a term", matters_behind_another, is_too_small_behind_another},
    {"certain, or held-out error", is_certain, is_not_certain},
});

}  // namespace

std::span<const NamingRule> naming_rules() {
  return kNamingRules;
}

const NamingRule* broken_rule(const FoundOnMotor& effect) {
  const auto broken = std::ranges::find_if(kNamingRules, [&](const NamingRule& rule) { return !rule.is_kept(effect); });
  return broken == kNamingRules.end() ? nullptr : &*broken;
}

std::string held_out_rise(const Resampling::FoundTerm& found) {
  return fmt::format("the error on experiments that are held out rises by {:.1f} % with it",
                     100.0 * (*found.held_out_ratio - 1.0));
}

bool is_contradicted(const Resampling::FoundTerm& found, const SearchedBalance& motor) {
  const CandidateFit* candidate = candidate_to_judge(found, motor);
  return candidate && !found.is_strongly_confirmed() && candidate->gain.score < -kPolicy.named_score &&
         candidate->fit.rmse_cv_fixed_effects() > motor.search.base.rmse_cv_fixed_effects();
}

bool may_be_stated(const Resampling& resampling, const Resampling::FoundTerm& found, const SearchedBalance& motor) {
  const double frequency_of_all = found.frequency * (1.0 - resampling.abstained / resampling.subsamples);
  const bool is_supported = frequency_of_all >= kPolicy.min_frequency_of_all || found.is_confirmed();
  const bool leaves_known_noise =
      motor.floor.rmse && motor.search.base.rmse() <= (1.0 + kPolicy.floor_uncertainty) * *motor.floor.rmse;
  // What the data cannot distinguish from a wave of the output's angle is the same function of it.
  const bool is_enough =
      std::ranges::any_of(found.group, is_of_output_angle) ? found.is_most_of_held_out_error() : is_supported;
  return std::any_of(found.group.begin(), found.group.end(), [&](const NamedEffect& name) {
    // Held-out motions may show what is below the noise in the fitted ones.
    if (is_enough &&
        (!leaves_known_noise || found.is_most_of_held_out_error() || catalogue::get(name.effect).is_presliding()))
      return true;
    return is_significant(motor, name);
  });
}

}  // namespace flexspline::selection
