#include "host/engine/selection/named_on_balances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/selection/balance_errors.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/deciding_method.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/named_by_resampling.hpp"
#include "host/engine/selection/other_balance_evidence.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

// Puts the effect to name first. Returns the name of an effect that it is named for as well, if there is one.
std::string choose_named(SearchedBalance& chosen) {
  auto& list = chosen.candidates;
  if (auto instead = backward_elimination(chosen.search, list)) {
    const auto is_it = [&](const CandidateFit& t) {
      return t.model.entry == instead->model.entry && t.model.order == instead->model.order;
    };
    // Held-out data and other checks may have refused it already.
    const auto searched = std::ranges::find_if(list, is_it);
    if (searched == list.end() || searched->admissible) {
      if (searched != list.end()) {
        instead->other_balance_score = searched->other_balance_score;
        instead->other_balance_percent = searched->other_balance_percent;
        instead->at_floor_on_others = searched->at_floor_on_others;
        if (instead->note.empty()) instead->note = searched->note;
        list.erase(searched);
      }
      list.insert(list.begin(), std::move(*instead));
      check_first(chosen);
      if (!chosen.names_one()) return {};
    }
  }
  const CandidateFit& first = list.front();
  if (!is_another_law(first, *chosen.search.data)) return {};
  const std::string_view other = first.model.entry->info->wide_negative_is;
  const auto law =
      std::find_if(list.begin(), list.end(), [&](const CandidateFit& t) { return t.model.entry->name() == other; });
  if (law == list.end() || law->gain.score <= kPolicy.named_score) return {};
  // The formula that leaves the other effects of the model their physical meaning comes first.
  if (!law->admissible) return std::string(other);
  std::string alias(first.model.entry->name());
  std::rotate(list.begin(), law, law + 1);
  return alias;
}

namespace {

// Whether resampling could not distinguish a candidate from the first one, and it leaves a similar error on all data.
bool is_in_group(const std::optional<Resampling>& resampling, const CandidateFit& first, const CandidateFit& t) {
  if (!resampling) return false;
  const auto group = resampling->found_group(name_of(first));
  return t.gain.chi2_percent >= kPolicy.similar * first.gain.chi2_percent &&
         100.0 - t.gain.chi2_percent <= kPolicy.similar_left * (100.0 - first.gain.chi2_percent) &&
         contains(group, name_of(t));
}

// The first candidate, and what cannot be distinguished from it.
std::vector<NamedEffect> likely_names(const SearchedBalance& chosen, const std::string& alias,
                                      const std::optional<Resampling>& resampling) {
  const auto& list = chosen.candidates;
  std::vector<NamedEffect> named;
  for (const CandidateFit& t : list) {
    const NamedEffect name = name_of(t);
    const double times_left =
        std::pow(t.fit.rmse_cv_fixed_effects() / std::max(list.front().fit.rmse_cv_fixed_effects(), 1e-300), 2);
    const bool near =
        (t.score() >= list.front().score() - kPolicy.confounded_margin && times_left <= kPolicy.similar_left) ||
        is_in_group(resampling, list.front(), t);
    // A law with more parameters and the same error is not confounded with the simpler one, as it contains it. One with
    // a slightly smaller error is.
    const bool wider = t.model.added > list.front().model.added && !t.leads && !is_angle_confounded(list.front(), t);
    if ((passes(t) && !wider && (near || is_scale_confounded(chosen.search, list.front(), t))) || name.effect == alias)
      named.push_back(name);
    // Its order is not identifiable, and it may also be the other effect.
    if (t.order_is_not_identifiable && near && t.model.entry != list.front().model.entry) named.push_back(name);
  }
  return named;
}

// Names are first in the list of candidates, even where a refused one has a higher score.
void put_first(Diagnosis& result) {
  auto begin = result.candidates.begin();
  for (const NamedEffect& n : result.named) {
    const auto at = std::find_if(begin, result.candidates.end(), [&](const Candidate& c) { return name_of(c) == n; });
    if (at != result.candidates.end()) std::rotate(begin++, at, at + 1);
  }
}

}  // namespace

void name_by_likelihood(const SearchedBalance& chosen, const std::string& alias, Diagnosis& result) {
  result.named = likely_names(chosen, alias, result.resampling);
  result.verdict = result.named.size() > 1 ? Verdict::confusable_effects : Verdict::missing_effect;
  for (Candidate& c : result.candidates) {
    if (!contains(result.named, name_of(c))) continue;
    const CandidateFit* fit = nullptr;
    for (const CandidateFit& t : chosen.candidates)
      if (name_of(c) == name_of(t)) fit = &t;
    if (fit != nullptr && fit->order_is_not_identifiable) c.admit();
    for (const NamedEffect& other : result.named)
      if (name_of(c) != other) c.cannot_distinguish.push_back(other.effect);
  }
  put_first(result);
}

namespace {

// What a balance lacks by itself: by resampling where that decides, else by likelihood. Nothing where it is not worth a
// term.
StableNames own_names(SearchedBalance& balance, const Diagnosis& result) {
  const bool is_motor = balance.search.data->balance() == estimation::Balance::motor;
  if (is_motor && result.resampling && deciding_method(*result.resampling, balance) == Method::resampling)
    return stable_names(*result.resampling, balance);
  if (!balance.names_one()) return {};
  const std::string alias = choose_named(balance);
  if (!balance.names_one() || balance.candidates.front().gain.chi2_percent < 100.0 * kPolicy.line_share) return {};
  const std::vector<NamedEffect> names = likely_names(balance, alias, std::nullopt);
  return {names, names.size() > 1};
}

// Whether what is named on another balance changes this one as well.
bool is_changed_by(const SearchedBalance& balance, const std::vector<NamedEffect>& named) {
  return std::any_of(named.begin(), named.end(), [&](const NamedEffect& n) {
    return catalogue::get(n.effect).adds_to(balance.search.data->balance());
  });
}

// An effect of another balance that acts on the one of `chosen` as well, and shows there with the same values, may be
// what was named there under another name: a wave of the torque's sensor looks like one of the motor. That name is
// taken back.
void take_back_confused(const CandidateFit& first, const SearchedBalance& chosen, Diagnosis& result) {
  if (!first.model.entry->adds_to(chosen.search.data->balance()) || first.other_balance_score <= kPolicy.named_score)
    return;
  const catalogue::Entry& entry = *first.model.entry;
  std::erase_if(result.named, [&](const NamedEffect& n) {
    if (!is_confused_with(first.model, catalogue::get(n.effect), n.order)) return false;
    result.possible.push_back({{n},
                               fmt::format("{}, which the {} balance shows, makes the same error here", entry.name(),
                                           catalogue::balance_name(entry.info->balance)),
                               std::nullopt,
                               std::nullopt});
    return true;
  });
}

}  // namespace

void name_on_other_balances(std::vector<SearchedBalance>& all, const SearchedBalance& chosen, const model::Drive& drive,
                            Diagnosis& result) {
  if (result.named.empty()) return;
  const std::vector<NamedEffect> first = result.named;
  for (SearchedBalance& balance : all) {
    if (&balance == &chosen || is_changed_by(balance, first)) continue;
    const auto [names, is_group] = own_names(balance, result);
    if (names.empty()) continue;
    if (is_group || result.verdict == Verdict::confusable_effects) {
      result.possible.push_back(
          {names,
           fmt::format(
               "the {} balance lacks {}", catalogue::balance_name(balance.search.data->balance()),
               is_group ? "one of them, and these data cannot show which" : "it, besides what is named on another one"),
           std::nullopt, std::nullopt});
      continue;
    }
    if (!balance.candidates.empty()) take_back_confused(balance.candidates.front(), chosen, result);
    for (const NamedEffect& n : names) {
      result.named.push_back(n);
      for (Candidate& c : result.candidates)
        if (name_of(c) == n) c.admit();
    }
    if (result.named == names) describe_base(balance, result);  // what the other balance named was taken back
    explain_named(balance.search, balance.candidates, drive, result);
  }
  put_first(result);
}

void list_waves_of_uncertain_period(const std::vector<SearchedBalance>& all, Diagnosis& result) {
  for (const SearchedBalance& balance : all)
    for (const CandidateFit& candidate : balance.candidates) {
      const NamedEffect name = name_of(candidate);
      const bool is_listed =
          contains(result.named, name) ||
          std::ranges::any_of(result.possible, [&](const PossibleEffect& p) { return contains(p.group, name); });
      if (candidate.has_uncertain_period && explains_a_part(candidate) && !is_listed)
        result.possible.push_back({{name}, candidate.why_not, std::nullopt, std::nullopt});
    }
}

}  // namespace flexspline::selection
