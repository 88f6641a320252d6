#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/comparison/noise_floor.hpp"
#include "host/comparison/residual_map.hpp"
#include "host/diagnosis/detectable.hpp"
#include "host/diagnosis/diagnosis.hpp"
#include "host/diagnosis/disturbances.hpp"
#include "host/diagnosis/doubts.hpp"
#include "host/diagnosis/examined.hpp"
#include "host/diagnosis/other_balances.hpp"
#include "host/diagnosis/resampling.hpp"
#include "host/diagnosis/rivals.hpp"
#include "host/diagnosis/trials.hpp"
#include "host/regression/in_parallel.hpp"
#include "host/regression/shapes.hpp"

namespace flexspline::diagnosis {
namespace {

using regression::Term;

// Maps of a complete model show significant shares of a few percent, too.
constexpr double kShownShare = 5.0;
// A delay is reported from this many standard errors on.
constexpr double kCertain = 5.0;
// An effect that takes off less of what stands above the floor leaves another unsaid: the best substitute for one that
// is not in the catalogue takes off 60 % and less.
constexpr double kRecovered = 80.0;
// What is left after that is shown even where no single variable explains much of it.
constexpr double kLeastShare = 1.0;

Candidate report(const Trial& trial, const Search& search, data::Axis axis) {
  Candidate c;
  c.effect = std::string(trial.proposal.entry->name());
  c.order = trial.proposal.order;
  c.balance = search.data->balance();
  c.score = trial.fall.score;
  c.score_elsewhere = trial.elsewhere;
  c.chi2_fall_percent = trial.fall.chi2_percent;
  c.rmse_cv_before = search.base.rmse_cv_alike();
  c.rmse_cv_after = trial.judged.rmse_cv_alike();
  c.p_value = trial.fall.p_value;
  c.admissible = trial.admissible;
  c.why_not = trial.why_not;
  if (!trial.imitated_by.empty()) c.rivals.push_back(trial.imitated_by);
  if (is_sublinear(trial, *search.data))
    c.note =
        "Both amplitudes are negative over a wide range of speed: this is sublinear friction, which grows ever more "
        "slowly with speed (see power_law_friction), and no Stribeck friction.";
  else if (is_rising(trial))
    c.note = "Both amplitudes are negative: friction rises out of standstill, so that slow motion starts smoothly.";
  if (!trial.note.empty()) c.note = trial.note;
  const std::size_t added = trial.judged.terms.size() - 1;
  const Term& term = trial.judged.terms[added];
  const std::vector<double> natural = catalogue::natural(*term.entry, term.values);
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    regression::Estimate e;
    e.slot = {added, p};
    e.id = term.id;
    e.effect = std::string(term.entry->name());
    e.parameter = std::string(term.entry->parameters[p].name);
    e.unit = std::string(catalogue::unit_on(term.entry->parameters[p].unit, axis));
    e.value = natural[p];
    e.fixed = term.known[p] != 0;
    if (const auto at = position(trial.judged, e.id, e.parameter)) {
      e.std = trial.judged.std[static_cast<Eigen::Index>(*at)];
      e.low = e.value - 1.96 * *e.std;
      e.high = e.value + 1.96 * *e.std;
    }
    c.parameters.push_back(std::move(e));
  }
  return c;
}

std::vector<Localised> shares(const BalanceData& data, const Judged& judged, const Eigen::VectorXd& residual,
                              double least = kShownShare) {
  std::vector<Localised> list;
  const data::Axis axis = data.prepared().rotary ? data::Axis::rotary : data::Axis::linear;
  for (const auto& share : comparison::localise(data, residual, judged.autocorrelation_time, axis))
    if (share.share_percent >= least) list.push_back({share.variable, share.share_percent});
  return list;
}

// Shapes were fitted as if friction were the same in all records. Where it is not, they are searched again with that
// known, or candidates would be named for no more than a better search.
void settle_shapes(Search& search) {
  BalanceData& data = *search.data;
  if (search.base.groups.empty() || search.base.deviations.std.maxCoeff() <= 0.0) return;
  regression::Terms terms = search.base.terms;
  const auto on_balance = regression::terms_on(terms, data.balance(), data.prepared().torque_measured);
  if (regression::free_shape_slots(terms, on_balance).empty()) return;
  constexpr double kTolerance = 1e-7;
  for (int round = 0; round < 2; ++round) {
    regression::refine_shapes(data, terms, on_balance, whitening_of(data, search.base), kTolerance);
    search.base = judge(data, terms, search.keep);
    terms = search.base.terms;
  }
}

std::vector<Examined> examine(regression::Identification& base, const std::vector<const data::Experiment*>& experiments,
                              const Options& options, Diagnosis& result) {
  std::vector<Examined> all;
  for (BalanceData& data : base.data) {
    if (options.progress)
      options.progress(fmt::format("trying effects ({} of {} balances)", all.size() + 1, base.data.size()));
    Examined one;
    one.search = {&data, Eigen::VectorXd::Ones(data.rows()), {}};
    Judged whole = judge(data, base.terms, one.search.keep);
    for (Disturbance& d : find_disturbances(data, whole.residual, one.search.keep)) {
      d.unit = result.unit;
      result.disturbances.push_back(std::move(d));
    }
    one.search.base = one.search.keep.minCoeff() < 1.0 ? judge(data, base.terms, one.search.keep) : std::move(whole);
    settle_shapes(one.search);
    one.trials = rank(one.search);
    if (std::string warning = one_way_warning(data); data.balance() == regression::Balance::motor && !warning.empty())
      result.warnings.push_back(std::move(warning));
    one.floor = comparison::pooled(comparison::noise_floors(data, one.search.base.terms, experiments, base.model.drive),
                                   data.records());
    one.search.floor = one.floor.rmse;
    all.push_back(std::move(one));
  }
  std::vector<Search*> searches;
  for (Examined& one : all) searches.push_back(&one.search);
  for (Examined& one : all) {
    hear_other_balances(searches, one.search, one.trials);
    doubt_orders(searches, one.search, one.trials);
  }
  return all;
}

// The balance whose named effect scores best; where none is named, the one that stands highest above its floor.
Examined& most_telling(std::vector<Examined>& all) {
  const auto importance = [](const Examined& e) {
    if (e.names_one()) return 1e9 + e.trials.front().score();
    return e.floor.rmse ? e.search.base.rmse() / *e.floor.rmse : 0.0;
  };
  return *std::max_element(all.begin(), all.end(),
                           [&](const Examined& a, const Examined& b) { return importance(a) < importance(b); });
}

// Puts the effect to name first. Returns the name of an effect that it stands for as well, if there is one.
std::string settle(Examined& chosen) {
  auto& list = chosen.trials;
  if (auto instead = eliminate(chosen.search, list.front())) {
    std::erase_if(list, [&](const Trial& t) {
      return t.proposal.entry == instead->proposal.entry && t.proposal.order == instead->proposal.order;
    });
    list.insert(list.begin(), std::move(*instead));
  }
  if (!is_sublinear(list.front(), *chosen.search.data)) return {};
  const auto law = std::find_if(list.begin(), list.end(),
                                [](const Trial& t) { return t.proposal.entry->name() == "power_law_friction"; });
  if (law == list.end() || law->fall.score <= kNamedScore) return {};
  // Which formula stands first is a matter of which one leaves the rest of the model its meaning.
  if (!law->admissible) return "power_law_friction";
  std::rotate(list.begin(), law, law + 1);
  return "stribeck_gaussian";
}

void name_effects(const Examined& chosen, const std::string& alias, Diagnosis& result) {
  const auto& list = chosen.trials;
  const auto is = [](const Candidate& c, const Named& n) { return c.effect == n.effect && c.order == n.order; };
  for (const Trial& t : list) {
    const Named name{std::string(t.proposal.entry->name()), t.proposal.order};
    const bool near = t.score() >= list.front().score() - kRivalMargin;
    // A law with more parameters that leaves the same error is no rival of the simpler one: it can do no worse. One
    // that earns them, if by little, is.
    const bool wider = t.proposal.added > list.front().proposal.added && !t.leads;
    if ((passes(t) && !wider && (near || scale_alike(chosen.search, list.front(), t))) || name.effect == alias)
      result.named.push_back(name);
    // Its order is not told, but neither is that it is the other effect.
    if (!t.doubtful_order || !near || t.proposal.entry == list.front().proposal.entry) continue;
    result.named.push_back(name);
    for (Candidate& c : result.candidates)
      if (is(c, name)) {
        c.admissible = true;
        c.why_not.clear();
      }
  }
  result.verdict = result.named.size() > 1 ? Verdict::confusable_effects : Verdict::missing_effect;
  for (Candidate& c : result.candidates) {
    if (std::none_of(result.named.begin(), result.named.end(), [&](const Named& n) { return is(c, n); })) continue;
    for (const Named& other : result.named)
      if (!is(c, other)) c.rivals.push_back(other.effect);
  }
  // The named effect leads the list, whatever a refused candidate scores.
  auto begin = result.candidates.begin();
  for (const Named& n : result.named) {
    const auto at = std::find_if(begin, result.candidates.end(), [&](const Candidate& c) { return is(c, n); });
    if (at != result.candidates.end()) std::rotate(begin++, at, at + 1);
  }
}

void list_candidates(std::vector<Examined>& all, data::Axis axis, Diagnosis& result) {
  for (Examined& e : all) {
    const Detection detection(e.search);
    std::vector<std::optional<Detectable>> smallest(e.trials.size());
    regression::in_parallel(e.trials.size(), [&](std::size_t i) {
      BalanceData data = *e.search.data;
      smallest[i] = detection.smallest(e.trials[i], data);
    });
    for (std::size_t i = 0; i < e.trials.size(); ++i) {
      const Trial& t = e.trials[i];
      result.candidates.push_back(report(t, e.search, axis));
      result.candidates.back().minimum_detectable = std::move(smallest[i]);
      if (t.imitated_by.empty()) continue;
      result.candidates.back().rival_reasons.push_back(compare_with_model(e.search, t));
      result.warnings.push_back(fmt::format(
          "{0} cannot be told from {1} in these data: {1} stands for what both share; {2} would tell them apart",
          t.proposal.entry->name(), t.imitated_by, t.proposal.entry->info->separated_by));
    }
  }
  std::stable_sort(result.candidates.begin(), result.candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.admissible != b.admissible ? a.admissible : a.score + a.score_elsewhere > b.score + b.score_elsewhere;
  });
}

// What is left, with the named effect in the model if there is one.
void judge_rest(const Examined& chosen, Diagnosis& result) {
  const Judged& after = result.named.empty() ? chosen.search.base : chosen.trials.front().judged;
  // What is missing may pass for a delay, so it is read off the better model.
  const Eigen::Index delay = after.theta.size() - 1;
  if (chosen.search.data->balance() == regression::Balance::motor &&
      std::abs(after.theta[delay]) > kCertain * after.std[delay])
    result.delay_s = after.theta[delay];
  result.friction_drift = drifts(after);
  for (const Drift& d : result.friction_drift)
    result.warnings.push_back(fmt::format(
        "{} differs between runs by {:.1f} %, and nothing that was recorded says why: temperature? An effect that "
        "shows "
        "only from run to run counts for less then; log the temperature, and repeat one motion from time to time",
        d.group, d.percent));
  const bool at_floor = result.noise_floor && after.rmse() < kAtFloor * *result.noise_floor;
  bool enough = true;
  if (result.noise_floor && !result.named.empty()) {
    const auto above = [&](const Judged& j) { return j.rmse() * j.rmse() - *result.noise_floor * *result.noise_floor; };
    if (above(chosen.search.base) > 0.0)
      result.recovered_percent = std::clamp(100.0 * (1.0 - above(after) / above(chosen.search.base)), 0.0, 100.0);
    enough = at_floor || result.recovered_percent.value_or(100.0) >= kRecovered;
  }
  const std::vector<Localised> remaining =
      shares(*chosen.search.data, after, after.residual, enough ? kShownShare : kLeastShare);
  if (!at_floor) result.remaining_structure = remaining;
  if (!result.named.empty()) return;
  if (at_floor)
    result.verdict = Verdict::at_noise_floor;
  else
    result.verdict =
        result.noise_floor && !remaining.empty() ? Verdict::unknown_structure : Verdict::nothing_significant;
}

}  // namespace

std::string verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::missing_effect:
      return "missing_effect";
    case Verdict::confusable_effects:
      return "confusable_effects";
    case Verdict::at_noise_floor:
      return "at_noise_floor";
    case Verdict::nothing_significant:
      return "nothing_significant";
    case Verdict::unknown_structure:
      return "unknown_structure";
    case Verdict::insufficient_excitation:
      return "insufficient_excitation";
  }
  return "";
}

Diagnosis diagnose(const data::Dataset& dataset, const model::Model& model, const Options& options) {
  Diagnosis result;
  result.unit = model.drive.axis == data::Axis::linear ? "N" : "N*m";
  if (options.progress) options.progress("fitting the model");
  const auto base = regression::identify(dataset, model, options.pipeline);
  result.warnings = base->warnings;
  result.parameter_trends = parameter_trends(*base);
  std::vector<const data::Experiment*> experiments;
  for (const data::Experiment& e : dataset.experiments)
    if (e.role == data::Role::fit) experiments.push_back(&e);

  std::vector<Examined> all = examine(*base, experiments, options, result);
  const bool moves = std::any_of(base->prepared.records.begin(), base->prepared.records.end(),
                                 [](const regression::Record& r) { return !r.at_rest; });
  const auto motor = std::find_if(
      all.begin(), all.end(), [](const Examined& e) { return e.search.data->balance() == regression::Balance::motor; });
  if (moves && motor != all.end()) {
    if (options.progress) options.progress("choosing effects on halves of the data");
    std::vector<const data::Experiment*> with_held_out;
    for (const data::Experiment& e : dataset.experiments)
      if (e.role == data::Role::fit || e.role == data::Role::holdout) with_held_out.push_back(&e);
    result.resampling = resample(with_held_out, base->model.drive, base->terms);
    result.resampling->decides = &most_telling(all) == &*motor && resampling_decides(*result.resampling, *motor);
  }
  const bool by_resampling = result.resampling && result.resampling->decides;
  Examined& chosen = by_resampling ? *motor : most_telling(all);
  std::string alias;
  if (chosen.names_one() && !by_resampling) {
    if (options.progress) options.progress("checking what else could explain it");
    alias = settle(chosen);
  }
  result.balance = chosen.search.data->balance();
  const Judged& judged = chosen.search.base;
  result.base_rmse = judged.rmse_alike();
  result.base_rmse_cv = judged.rmse_cv_alike();
  result.base_rmse_own_friction = judged.rmse();
  result.noise_floor = chosen.floor.rmse;
  result.noise_floor_from = chosen.floor.from;
  // Where nothing is missing, friction that differs between runs is no structure to look for.
  const bool names_one = chosen.names_one() && !by_resampling;
  result.localised =
      shares(*chosen.search.data, judged, names_one || by_resampling ? judged.residual_alike() : judged.residual);
  list_candidates(all, model.drive.axis, result);
  if (by_resampling) name_stable(chosen, result);
  if (names_one) name_effects(chosen, alias, result);
  if (!result.named.empty()) explain_named(chosen.search, chosen.trials, model.drive.axis, result);
  judge_rest(chosen, result);
  if (!by_resampling || result.named.empty()) {
    if (options.progress) options.progress("looking for what no effect explains");
    tell_unknown(chosen.search, names_one ? &chosen.trials.front() : nullptr, result);
  }
  if (result.resampling && result.resampling->too_little)
    result.warnings.push_back(
        "these data have too few rows to choose effects on halves of them; record longer, with several strokes");
  if (!moves || (result.resampling && result.resampling->too_little)) result.verdict = Verdict::insufficient_excitation;
  return result;
}

}  // namespace flexspline::diagnosis
