#include "host/engine/selection/named_by_resampling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/selection/joint_names.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/record_cross_validation.hpp"

namespace flexspline::selection {

bool is_of_family(const NamedEffect& a, const NamedEffect& b) {
  if (a.order != b.order) return false;
  const catalogue::Entry &one = catalogue::get(a.effect), &other = catalogue::get(b.effect);
  return &one == &other || (!one.info->family.empty() && one.info->family == other.info->family) ||
         (one.is_presliding() && other.is_presliding());
}

namespace {

// The candidate of a single effect that was found, of those that likelihood can judge: it leaves out reversals, where
// alone presliding shows. Null: there is none.
const CandidateFit* judged_candidate(const Resampling::FoundTerm& found, const SearchedBalance& motor) {
  if (found.group.size() != 1) return nullptr;
  const NamedEffect& name = found.group.front();
  if (catalogue::get(name.effect).is_presliding()) return nullptr;
  for (const CandidateFit& t : motor.candidates)
    if (t.model.entry->name() == name.effect && t.model.order == name.order) return &t;
  return nullptr;
}

bool is_of_family(const std::string& effect, std::optional<double> order, const CandidateFit& candidate) {
  return selection::is_of_family(NamedEffect{effect, order}, name_of(candidate));
}

// Of a candidate; nothing where resampling cannot choose it: it has no linear parameter, or more nonlinear ones than
// one.
std::optional<double> support_of(const Resampling& resampling, const CandidateFit& candidate) {
  std::optional<double> support;
  for (const Resampling::Support& s : resampling.support)
    if (is_of_family(s.effect, s.order, candidate)) support = std::max(support.value_or(0.0), s.frequency);
  return support;
}

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

// Whether the model with the best effect leaves known noise: as large as a noise floor that is not from a fit, with no
// more correlation than the filter causes.
bool reaches_floor(const SearchedBalance& e) {
  if (!e.floor.rmse || !e.names_one()) return false;
  const CandidateFit& first = e.candidates.front();
  return std::abs(first.fit.rmse() / *e.floor.rmse - 1.0) < kPolicy.floor_uncertainty &&
         first.fit.autocorrelation_time <
             (1.0 + kPolicy.filter_uncertainty) * e.search.data->filter_autocorrelation_time() &&
         (!is_of_effort(first) || takes_off_nearly_all(e, first));
}

// Whether resampling found another effect that explains what is above the noise, too.
bool explains_instead(const Resampling& resampling, const CandidateFit& first) {
  return std::any_of(resampling.found.begin(), resampling.found.end(), [&](const Resampling::FoundTerm& f) {
    return !f.group.empty() && !f.refused_by_holdout && f.share_percent >= kPolicy.recovered_percent &&
           (f.frequency >= kPolicy.certain_frequency || f.is_strongly_confirmed()) &&
           std::none_of(f.group.begin(), f.group.end(),
                        [&](const NamedEffect& n) { return is_of_family(n.effect, n.order, first); });
  });
}

// Whether the model with the best effect leaves noise: then likelihood alone decides. Where more than one effect is
// missing, structure remains whatever is added, and a small decrease proves nothing. Where the noise floor is unknown,
// the residual must be white, of three records or more, as what is peculiar to one motion may be white in its own
// record; and an effect of the effort alone is not taken, as it may explain its own noise.
bool leaves_noise(const SearchedBalance& e, double von_neumann_ratio) {
  const CrossValidatedFit& fit = e.names_one() ? e.candidates.front().fit : e.search.base;
  if (e.floor.rmse) return fit.rmse() < kPolicy.at_floor * *e.floor.rmse;
  if (e.search.data->records().size() < estimation::kFewestRecords) return false;
  return von_neumann_ratio >= kPolicy.white && !(e.names_one() && is_of_effort(e.candidates.front()));
}

// Whether the likelihood of all data is significant for an effect.
bool is_significant(const SearchedBalance& motor, const NamedEffect& name) {
  return std::any_of(motor.candidates.begin(), motor.candidates.end(), [&](const CandidateFit& candidate) {
    return is_of_family(name.effect, name.order, candidate) && candidate.gain.score > kPolicy.named_score;
  });
}

// Whether an effect is a wave of the output's angle. Over a part of a turn that is an offset and a slope, which halves
// choose for any slow function of the angle.
bool is_of_output_angle(const NamedEffect& name) {
  return (catalogue::get(name.effect).info->reads & effects::kOutputAngle) != 0;
}

}  // namespace

bool may_be_stated(const Resampling& resampling, const Resampling::FoundTerm& found, const SearchedBalance& motor) {
  const double frequency_of_all = found.frequency * (1.0 - resampling.abstained / resampling.subsamples);
  const bool is_supported = frequency_of_all >= kPolicy.min_frequency_of_all || found.is_confirmed();
  const bool leaves_known_noise =
      motor.floor.rmse && motor.search.base.rmse() <= (1.0 + kPolicy.floor_uncertainty) * *motor.floor.rmse;
  return std::any_of(found.group.begin(), found.group.end(), [&](const NamedEffect& name) {
    const bool is_enough = is_of_output_angle(name) ? found.is_most_of_held_out_error() : is_supported;
    if (is_enough && (!leaves_known_noise || catalogue::get(name.effect).is_presliding())) return true;
    return is_significant(motor, name);
  });
}

namespace {

// Whether the halves of fewer than three records, of unknown noise, may decide: parts of the same motions agree in what
// is peculiar to these. So where data are held out, their error has to confirm it, or the likelihood of all data.
bool carries_over(const Resampling::FoundTerm& found, const SearchedBalance& motor) {
  if (motor.search.data->records().size() >= estimation::kFewestRecords || motor.floor.rmse || !found.held_out_ratio)
    return true;
  return found.is_confirmed() || std::any_of(found.group.begin(), found.group.end(),
                                             [&](const NamedEffect& name) { return is_significant(motor, name); });
}

// Whether resampling cannot choose an effect on these data although the model could have it: what corrects the effort,
// where that has no peaks.
bool is_not_visible(const Resampling& resampling, const CandidateFit& candidate) {
  return std::any_of(resampling.not_visible.begin(), resampling.not_visible.end(),
                     [&](const std::string& name) { return name == candidate.model.entry->name(); });
}

// The effect that resampling cannot choose, that is confused with what it found, and is likelier; null: there is none.
const CandidateFit* likelier_unseen(const Resampling& resampling, const Resampling::FoundTerm& found,
                                    const SearchedBalance& motor) {
  double score = kPolicy.named_score;
  for (const CandidateFit& t : motor.candidates)
    for (const NamedEffect& n : found.group) {
      // Likelihood leaves out reversals, where alone presliding shows.
      if (catalogue::get(n.effect).is_presliding()) return nullptr;
      if (is_of_family(n.effect, n.order, t)) score = std::max(score, t.gain.score + kPolicy.confounded_margin);
    }
  const auto is_confused = [&](const catalogue::Entry& unseen) {
    return std::any_of(found.group.begin(), found.group.end(), [&](const NamedEffect& n) {
      return catalogue::names_contain(unseen.info->confused_with, n.effect) ||
             catalogue::names_contain(catalogue::get(n.effect).info->confused_with, unseen.name());
    });
  };
  for (const CandidateFit& t : motor.candidates)
    if (passes(t) && t.gain.score > score && is_not_visible(resampling, t) && is_confused(*t.model.entry)) return &t;
  return nullptr;
}

// The effects to name, among those in the catalogue that do not increase the held-out error: the group with the largest
// share where these data cannot distinguish its members, else all single ones. After the first, a term below the share
// of a linear term is a remainder of the first law, or not worth a parameter.
std::vector<NamedEffect> names_of(const Resampling& resampling, const SearchedBalance& motor) {
  const double least_percent = 100.0 * kPolicy.line_share;
  std::vector<NamedEffect> names;
  const bool is_judged_by_few = is_within_floor_of_few_records(motor.search);
  for (const Resampling::FoundTerm& found : resampling.found) {
    if (found.group.empty() || found.refused_by_holdout) continue;
    if (!may_be_stated(resampling, found, motor) || !carries_over(found, motor)) continue;
    if ((is_judged_by_few || found.is_second_choice) && !found.is_confirmed()) continue;
    if (is_contradicted(found, motor)) continue;
    if (likelier_unseen(resampling, found, motor)) continue;
    if (names.empty() && found.group.size() > 1) return found.group;
    if (found.group.size() > 1) continue;
    if (!names.empty() && found.share_percent < least_percent && !found.is_strongly_confirmed()) continue;
    // Behind another one, a name that is not certain may be what the first law leaves: held-out experiments decide.
    const bool is_certain =
        found.frequency >= kPolicy.certain_frequency || !found.held_out_ratio || found.is_confirmed();
    if (!names.empty() && !is_certain) continue;
    names.push_back(found.group.front());
  }
  return names;
}

bool names_several(const Resampling& resampling, const SearchedBalance& motor) {
  const std::vector<NamedEffect> names = names_of(resampling, motor);
  return names.size() > 1 && resampling.found_group(names.front()).size() < 2;
}

// Where no torque is known, data do not show whether the scale of the motor's torque or that of its sensor is wrong.
// Adds the other one to a name that stands alone; false: there is none to add.
bool add_other_scale(const SearchedBalance& motor, std::vector<NamedEffect>& names) {
  const auto is_scale = [](const catalogue::Entry& entry) { return (entry.info->reads & effects::kTorqueScale) != 0; };
  if (names.size() != 1 || states_a_torque(motor.search.base.terms)) return false;
  const std::string first = names.front().effect;
  if (!is_scale(catalogue::get(first))) return false;
  for (const CandidateFit& t : motor.candidates)
    if (t.model.entry->name() != first && is_scale(*t.model.entry) && passes(t))
      names.push_back({std::string(t.model.entry->name()), t.model.order});
  return names.size() > 1;
}

// Why a group that is not named is not. `behind`: something else is.
std::string why_not_named(const Resampling::FoundTerm& term, bool is_undecided, bool behind) {
  if (term.may_be_sticking)
    return "its travel is no longer than what steps and noise of the encoder hide: the axis may only stick";
  if (term.refused_by_holdout)
    return fmt::format("the error on experiments that are held out rises by {:.1f} % with it",
                       100.0 * (*term.held_out_ratio - 1.0));
  if (is_undecided && term.frequency >= kPolicy.named_frequency && term.least_by_mask < 1.0 - kPolicy.named_frequency)
    return fmt::format("of those with the reversals, or of those without, only {:.0f} of 100 did",
                       100.0 * term.least_by_mask);
  if (is_undecided)
    return fmt::format("{:.0f} are needed, {:.0f} where it shows little or behind an unknown structure",
                       100.0 * kPolicy.named_frequency, 100.0 * kPolicy.certain_frequency);
  if (behind && term.group.size() > 1) return "its members cannot be distinguished, and what is named explains more";
  if (behind && term.share_percent < 100.0 * kPolicy.line_share)
    return fmt::format(
        "it explains {:.1f} % of the squared error above the noise, and {:.0f} % are needed behind "
        "another effect",
        term.share_percent, 100.0 * kPolicy.line_share);
  if (is_of_output_angle(term.group.front()))
    return "other functions of the output's angle look like it on these data: its likelihood would have to be "
           "significant, or the squared error on experiments that are held out to fall by half";
  if (term.held_out_ratio && !term.is_confirmed())
    return fmt::format("the error on experiments that are held out falls by {:.1f} % only",
                       100.0 * (1.0 - *term.held_out_ratio));
  return "the model alone is near the noise in most subsamples, or in fewer than three records";
}

// Why resampling does not name what likelihood would.
std::string why_not_chosen(const Resampling& resampling, const CandidateFit& first) {
  const std::optional<double> support = support_of(resampling, first);
  if (!support || is_not_visible(resampling, first)) return "halves of the data cannot judge it here";
  const std::string chosen = fmt::format("{:.0f} of 100 subsamples", 100.0 * *support);
  if (*support < kPolicy.named_frequency) return fmt::format("only {} chose it", chosen);
  return fmt::format("in {} something else did nearly as well", chosen);
}

// Groups of the catalogue that were found, or are undecided, and are not named.
std::vector<PossibleEffect> possible_effects(const Resampling& resampling, const SearchedBalance& motor,
                                             const std::vector<NamedEffect>& named) {
  std::vector<PossibleEffect> all;
  const auto is_named = [&](const NamedEffect& a) {
    return std::any_of(named.begin(), named.end(),
                       [&](const NamedEffect& b) { return a.effect == b.effect && a.order == b.order; });
  };
  const auto add = [&](const Resampling::FoundTerm& term, bool is_undecided) {
    if (term.group.empty() || std::any_of(term.group.begin(), term.group.end(), is_named)) return;
    const CandidateFit* unseen = is_undecided ? nullptr : likelier_unseen(resampling, term, motor);
    const std::string why =
        unseen ? fmt::format("{}, which halves of the data cannot judge here, is likelier", unseen->model.entry->name())
        : !is_undecided && is_contradicted(term, motor)
            ? fmt::format("with it, the likelihood of all data falls (score {:.0f})",
                          judged_candidate(term, motor)->gain.score)
            : why_not_named(term, is_undecided, !named.empty());
    all.push_back({term.group, why, term.frequency, term.held_out_ratio});
  };
  for (const Resampling::FoundTerm& term : resampling.found) add(term, false);
  for (const Resampling::FoundTerm& term : resampling.undecided) add(term, true);
  // What likelihood alone would name.
  if (!motor.names_one()) return all;
  const CandidateFit& first = motor.candidates.front();
  const NamedEffect name = name_of(first);
  const auto is_listed = [&](const PossibleEffect& p) {
    return std::any_of(p.group.begin(), p.group.end(),
                       [&](const NamedEffect& n) { return is_of_family(n.effect, n.order, first); });
  };
  const bool is_in_names = std::any_of(named.begin(), named.end(),
                                       [&](const NamedEffect& n) { return is_of_family(n.effect, n.order, first); });
  if (is_in_names || first.model.entry->is_presliding() || std::any_of(all.begin(), all.end(), is_listed) ||
      first.gain.chi2_percent < 100.0 * kPolicy.line_share)
    return all;
  all.push_back({{name},
                 fmt::format("its likelihood is significant (score {:.0f}), but {}", first.gain.score,
                             why_not_chosen(resampling, first)),
                 std::nullopt,
                 first.held_out_ratio});
  return all;
}

}  // namespace

bool is_contradicted(const Resampling::FoundTerm& found, const SearchedBalance& motor) {
  const CandidateFit* candidate = judged_candidate(found, motor);
  return candidate && !found.is_strongly_confirmed() && candidate->gain.score < -kPolicy.named_score &&
         candidate->fit.rmse_cv_fixed_effects() > motor.search.base.rmse_cv_fixed_effects();
}

void take_likelier_waves(Resampling& resampling, const SearchedBalance& motor) {
  const auto candidate = [&](std::string_view effect, std::optional<double> order) {
    return std::find_if(motor.candidates.begin(), motor.candidates.end(), [&](const CandidateFit& t) {
      return t.model.entry->name() == effect && t.model.order == order;
    });
  };
  for (Resampling::FoundTerm& found : resampling.found) {
    if (found.group.size() != 1 || !found.group.front().order) continue;
    const NamedEffect name = found.group.front();
    const auto own = candidate(name.effect, name.order);
    const double own_score = own == motor.candidates.end() ? 0.0 : own->gain.score;
    for (const std::string_view wave : catalogue::split_names(catalogue::get(name.effect).info->phase_error_of)) {
      const auto other = candidate(wave, name.order);
      if (other == motor.candidates.end() || !passes(*other)) continue;
      const double more = other->gain.score - own_score;
      if (more < -kPolicy.confounded_margin) continue;
      found.group = {{std::string(wave), name.order}};
      if (more <= kPolicy.confounded_margin) found.group.push_back(name);
      break;
    }
  }
}

void add_identical_effects(Resampling& resampling, const SearchedBalance& motor) {
  constexpr double kRounding = 1e-6;  // relative
  const auto are_same = [](double a, double b) { return std::abs(a - b) <= kRounding * std::abs(a); };
  for (Resampling::FoundTerm& found : resampling.found) {
    const CandidateFit* own = judged_candidate(found, motor);
    if (!own || own->gain.chi2_percent == 0.0) continue;
    for (const CandidateFit& t : motor.candidates)
      if (&t != own && t.admissible && are_same(own->gain.score, t.gain.score) &&
          are_same(own->gain.chi2_percent, t.gain.chi2_percent))
        found.group.push_back({std::string(t.model.entry->name()), t.model.order});
  }
}

bool is_delay_of_current(const catalogue::Entry& entry) {
  return entry.has_state && entry.info->reads == effects::kCurrent;
}

bool stands_alone(const Resampling& resampling, const CandidateFit& first) {
  if (!resampling.found.empty() || !first.held_out_ratio) return false;
  const double fall = 1.0 - *first.held_out_ratio * *first.held_out_ratio;
  // A lag is in the model that a delay is compared with, so that the likelihood counts only what is more than a lag.
  const bool is_lag = is_delay_of_current(*first.model.entry) && resampling.lag_s.value_or(0.0) < 0.0;
  if (is_lag && resampling.lag_share >= kPolicy.most_share && fall >= kPolicy.most_share) return true;
  return first.gain.chi2_percent >= 100.0 * kPolicy.most_share && fall >= kPolicy.matters_share;
}

bool resampling_decides(const Resampling& resampling, const SearchedBalance& motor) {
  if (resampling.subsamples == 0.0) return resampling.too_little;
  if (!motor.names_one()) return true;
  const CandidateFit& first = motor.candidates.front();
  if (reaches_floor(motor) && !explains_instead(resampling, first)) return false;
  // Likelihood leaves out reversals, where alone presliding shows.
  if (first.model.entry->is_presliding()) return true;
  const std::optional<double> support = support_of(resampling, first);
  if (!support && first.gain.chi2_percent > kPolicy.nearly_all_percent && !explains_instead(resampling, first))
    return false;
  if (!support && stands_alone(resampling, first)) return false;
  const auto is_first = [&](const NamedEffect& n) { return is_of_family(n.effect, n.order, first); };
  const bool found_first = std::any_of(resampling.found.begin(), resampling.found.end(), [&](const auto& f) {
    return std::any_of(f.group.begin(), f.group.end(), is_first);
  });
  if (!resampling.found.empty() && !found_first) return true;
  // Likelihood is the more sensitive method where exactly one effect is missing.
  if (names_several(resampling, motor)) return true;
  const bool silent = resampling.abstained > kPolicy.most_abstaining * resampling.subsamples;
  if (!silent && support && *support < kPolicy.named_frequency) return true;
  // An effect built from the measured effort or from a noisy torque also explains its noise.
  if (!support && is_of_effort(first)) return true;
  if (resampling.torque_has_noise && is_of_torque(first)) return true;
  return !leaves_noise(motor, resampling.von_neumann_ratio);
}

bool names_any(const Resampling& resampling, const SearchedBalance& motor) {
  return !names_of(resampling, motor).empty();
}

StableNames stable_names(const Resampling& resampling, const SearchedBalance& motor) {
  StableNames stable{names_of(resampling, motor), false};
  stable.is_group = !stable.names.empty() && resampling.found_group(stable.names.front()).size() > 1;
  // Laws of one family: the one that fits best with its nonlinear parameters searched continuously.
  for (NamedEffect& n : stable.names) {
    const std::string_view family = catalogue::get(n.effect).info->family;
    if (family.empty()) continue;
    const CandidateFit* best = nullptr;
    for (const CandidateFit& t : motor.candidates)
      if (t.model.entry->info->family == family && t.admissible && (!best || t.gain.score > best->gain.score))
        best = &t;
    if (best) n.effect = std::string(best->model.entry->name());
  }
  return stable;
}

void name_stable(SearchedBalance& chosen, Diagnosis& result) {
  const StableNames stable = stable_names(*result.resampling, chosen);
  result.named = stable.names;
  result.possible = possible_effects(*result.resampling, chosen, names_of(*result.resampling, chosen));
  if (!stable.is_group) {
    JointNames joint = eliminate_backward(*result.resampling, chosen, stable.names);
    result.named = std::move(joint.names);
    const auto is_named = [&](const PossibleEffect& p) {
      return std::any_of(result.named.begin(), result.named.end(), [&](const NamedEffect& n) {
        return p.group.size() == 1 && p.group.front().effect == n.effect && p.group.front().order == n.order;
      });
    };
    std::erase_if(result.possible, is_named);
    for (NamedEffect& name : joint.eliminated)
      result.possible.push_back({{std::move(name)},
                                 "once the other effects are in the model, left-out data gain nothing by it",
                                 std::nullopt,
                                 std::nullopt});
  }
  const bool is_group = add_other_scale(chosen, result.named) || stable.is_group;
  result.partial =
      static_cast<std::ptrdiff_t>(result.resampling->found.size()) > (is_group ? 1 : std::ssize(result.named));
  if (result.named.empty()) return;
  result.verdict = is_group ? Verdict::confusable_effects : Verdict::missing_effect;
  const auto is = [](const Candidate& c, const NamedEffect& n) { return c.effect == n.effect && c.order == n.order; };
  auto begin = result.candidates.begin() - result.candidates.begin();
  for (const NamedEffect& n : result.named) {
    auto at = std::find_if(result.candidates.begin() + begin, result.candidates.end(),
                           [&](const Candidate& c) { return is(c, n); });
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
      if (is_group && !is(*at, other)) at->cannot_distinguish.push_back(other.effect);
    std::rotate(result.candidates.begin() + begin, at, at + 1);
    ++begin;
  }
  const auto candidate = std::find_if(chosen.candidates.begin(), chosen.candidates.end(), [&](const CandidateFit& t) {
    return t.model.entry->name() == result.named.front().effect && t.model.order == result.named.front().order;
  });
  if (candidate != chosen.candidates.end()) std::rotate(chosen.candidates.begin(), candidate, candidate + 1);
}

}  // namespace flexspline::selection
