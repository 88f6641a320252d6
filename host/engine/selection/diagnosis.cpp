#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/comparison/noise_floor.hpp"
#include "host/engine/comparison/residual_map.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/standard_intervals.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/between_records.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/detection_limit.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/disturbances.hpp"
#include "host/engine/selection/encoder_errors.hpp"
#include "host/engine/selection/friction_scaling.hpp"
#include "host/engine/selection/held_out.hpp"
#include "host/engine/selection/named_by_resampling.hpp"
#include "host/engine/selection/named_on_balances.hpp"
#include "host/engine/selection/other_balance_evidence.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/record_cross_validation.hpp"
#include "host/engine/selection/resampling.hpp"
#include "host/engine/selection/searched_balance.hpp"
#include "host/engine/selection/significance_checks.hpp"
#include "host/engine/selection/wald_test.hpp"

namespace flexspline::selection {
namespace {

using estimation::Term;

Candidate candidate_of(const CandidateFit& candidate, const BalanceSearch& search, data::Axis axis) {
  Candidate c;
  c.effect = std::string(candidate.model.entry->name());
  c.order = candidate.model.order;
  c.balance = search.data->balance();
  c.score = candidate.gain.score;
  c.other_balance_score = candidate.other_balance_score;
  c.chi2_decrease_percent = candidate.gain.chi2_percent;
  c.rmse_cv_before = search.base.rmse_cv_fixed_effects();
  c.rmse_cv_after = candidate.fit.rmse_cv_fixed_effects();
  c.p_value = candidate.gain.p_value;
  c.admissible = candidate.admissible;
  c.why_not = candidate.why_not;
  if (!candidate.confounded_with.empty()) c.cannot_distinguish.push_back(candidate.confounded_with);
  const effects::Description& info = *candidate.model.entry->info;
  if (is_another_law(candidate, *search.data))
    c.note = fmt::format("Both amplitudes are negative over a wide range of speed: {}.", info.wide_negative_means);
  else if (is_negative(candidate))
    c.note = fmt::format("Both amplitudes are negative: {}.", info.negative_means);
  if (!candidate.note.empty()) c.note = candidate.note;
  const std::size_t added = candidate.fit.terms.size() - 1;
  const Term& term = candidate.fit.terms[added];
  const std::vector<double> natural = catalogue::natural(*term.entry, term.values);
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    estimation::Estimate e;
    e.ref = {added, p};
    e.id = term.id;
    e.effect = std::string(term.entry->name());
    e.parameter = std::string(term.entry->parameters[p].name);
    e.unit = std::string(catalogue::unit_on(term.entry->parameters[p].unit, axis));
    e.value = natural[p];
    e.fixed = term.known[p] != 0;
    if (const auto at = position(candidate.fit, e.id, e.parameter)) {
      e.std = candidate.fit.std[static_cast<Eigen::Index>(*at)];
      const estimation::Interval interval = estimation::interval_95(e.value, *e.std);
      e.low = interval.low;
      e.high = interval.high;
    }
    c.parameters.push_back(std::move(e));
  }
  return c;
}

std::vector<LocalisedResidual> shares(const RegressionProblem& data, const CrossValidatedFit& fit,
                                      const Eigen::VectorXd& residual, double least = kPolicy.shown_share_percent) {
  std::vector<LocalisedResidual> list;
  const data::Axis axis = data.prepared().rotary ? data::Axis::rotary : data::Axis::linear;
  for (const auto& share : comparison::localise(data, residual, fit.autocorrelation_time, axis))
    if (share.share_percent >= least) list.push_back({share.variable, share.share_percent});
  return list;
}

// The nonlinear parameters were fitted with the same friction in all records. Where friction differs, they are searched
// again with random effects; else a candidate could be named only because its search was better.
void refine_base_nonlinear(BalanceSearch& search) {
  const RegressionProblem& data = *search.data;
  if (search.base.groups.empty() || search.base.random_effects.std.maxCoeff() <= 0.0) return;
  estimation::Terms terms = search.base.terms;
  const auto on_balance = estimation::terms_on(terms, data.balance(), data.prepared().output_signals);
  if (estimation::free_nonlinear_parameters(terms, on_balance).empty()) return;
  constexpr double kTolerance = 1e-7;
  for (int round = 0; round < 2; ++round) {
    estimation::refine_nonlinear(data, terms, on_balance, noise_covariance(data, search.base), kTolerance);
    search.base = cross_validate(data, terms, search.keep);
    terms = search.base.terms;
  }
}

std::vector<const data::Experiment*> of_role(const data::Dataset& dataset, data::Role role) {
  std::vector<const data::Experiment*> found;
  for (const data::Experiment& e : dataset.experiments)
    if (e.role == role) found.push_back(&e);
  return found;
}

std::vector<SearchedBalance> search_balances(estimation::Identification& base, const data::Dataset& dataset,
                                             const Options& options, Diagnosis& result) {
  const std::vector<const data::Experiment*> experiments = of_role(dataset, data::Role::fit);
  std::vector<SearchedBalance> all;
  for (const RegressionProblem& data : base.data) {
    if (options.progress)
      options.progress(fmt::format("trying effects ({} of {} balances)", all.size() + 1, base.data.size()));
    SearchedBalance one;
    one.search = {&data, Eigen::VectorXd::Ones(data.rows()), {}};
    CrossValidatedFit whole = cross_validate(data, base.terms, one.search.keep);
    for (Disturbance& d : find_disturbances(data, whole.residual, one.search.keep)) {
      d.unit = result.unit;
      result.disturbances.push_back(std::move(d));
    }
    one.search.base =
        one.search.keep.minCoeff() < 1.0 ? cross_validate(data, base.terms, one.search.keep) : std::move(whole);
    refine_base_nonlinear(one.search);
    one.candidates = rank_candidates(one.search);
    if (std::string warning = one_direction_warning(data);
        data.balance() == estimation::Balance::motor && !warning.empty())
      result.warnings.push_back(std::move(warning));
    one.floors = comparison::noise_floors(data, one.search.base.terms, experiments, base.model.drive);
    one.floor = comparison::pooled(one.floors, data.records());
    one.search.floor = one.floor.rmse;
    all.push_back(std::move(one));
  }
  std::vector<BalanceSearch*> searches;
  for (SearchedBalance& one : all) searches.push_back(&one.search);
  for (SearchedBalance& one : all) {
    add_other_balance_evidence(searches, one.search, one.candidates);
    check_orders(searches, one.search, one.candidates);
    check_by_record(one.search, one.candidates);
    // Of the torsion each record has a zero of its own, which the held-out ones were not fitted for.
    if (one.search.data->balance() != estimation::Balance::motor) {
      check_encoder_errors(one.search, one.candidates);
      check_worth(one.search, one.candidates);
      continue;
    }
    const HeldOut held_out(dataset, base, estimation::Balance::motor, options.pipeline.ready.get());
    check_on_held_out(held_out, one.search, one.candidates);
  }
  for (SearchedBalance& one : all) discount_evidence(all, one);
  return all;
}

// The balance whose named effect scores best; where none is named, the one that is highest above its floor. A torsion
// that is hardly above its noise shows errors of the encoders before anything else, so that its balance comes last.
SearchedBalance& most_significant(std::vector<SearchedBalance>& all, const std::optional<Resampling>& by_resampling) {
  const auto importance = [&](const SearchedBalance& e) {
    const RegressionProblem& data = *e.search.data;
    const bool is_noisy =
        data.balance() == estimation::Balance::transmission && data.prepared().pipeline.keep_torsion_reversals;
    const bool is_motor = data.balance() == estimation::Balance::motor;
    const bool names_one = is_motor && by_resampling ? names_any(*by_resampling, e) : e.names_one();
    if (names_one && !e.candidates.empty()) return (is_noisy ? 1e9 : 2e9) + e.candidates.front().score();
    return e.floor.rmse ? e.search.base.rmse() / *e.floor.rmse : 0.0;
  };
  return *std::max_element(all.begin(), all.end(), [&](const SearchedBalance& a, const SearchedBalance& b) {
    return importance(a) < importance(b);
  });
}

// Error and noise of the records whose noise is known, where that of all is not.
std::optional<NoiseOfSome> noise_of_some(const SearchedBalance& balance) {
  if (balance.floor.rmse) return std::nullopt;
  const RegressionProblem& data = *balance.search.data;
  const Eigen::VectorXd residual = balance.search.base.residual_fixed_effects();
  NoiseOfSome some;
  std::vector<comparison::NoiseFloor> known;
  std::vector<estimation::RowRange> rows;
  double squares = 0.0, count = 0.0;
  for (std::size_t i = 0; i < balance.floors.size(); ++i) {
    const estimation::RowRange& range = data.records()[i];
    const estimation::Record& record = data.prepared().records[range.record];
    if (!balance.floors[i].rmse || record.at_rest) continue;
    some.records.push_back(record.name);
    known.push_back(balance.floors[i]);
    rows.push_back(range);
    squares += residual.segment(range.first, range.size()).squaredNorm();
    count += static_cast<double>(range.size());
  }
  if (known.empty()) return std::nullopt;
  const comparison::NoiseFloor pooled = comparison::pooled(known, rows);
  some.rmse = std::sqrt(squares / count);
  some.noise = *pooled.rmse;
  some.from = pooled.from;
  return some;
}

// The errors of the model without what is named, and the noise.
void describe_base(const SearchedBalance& chosen, Diagnosis& result) {
  const RegressionProblem& data = *chosen.search.data;
  const CrossValidatedFit& fit = chosen.search.base;
  result.balance = data.balance();
  result.base_rmse = fit.rmse_fixed_effects();
  result.base_rmse_cv = fit.rmse_cv_fixed_effects();
  result.base_rmse_own_friction = fit.rmse();
  result.noise_floor = chosen.floor.rmse;
  result.noise_floor_from = chosen.floor.from;
  result.noise_of_some = noise_of_some(chosen);
  const std::vector<estimation::Record>& records = data.prepared().records;
  result.reversals_left_out = std::any_of(records.begin(), records.end(), [&](const estimation::Record& r) {
    return r.rows[estimation::index(data.balance())].masked > 0;
  });
}

// The errors of the motor's balance, in place of those of the one that was judged.
void describe_motor_instead(const SearchedBalance& judged, const SearchedBalance& motor, Diagnosis& result) {
  if (result.noise_floor)
    result.warnings.push_back(fmt::format(
        "the {} balance has an error of {:.3g} times its noise, which no effect of the catalogue explains; flexspline "
        "compare shows where",
        catalogue::balance_name(judged.search.data->balance()), result.base_rmse / *result.noise_floor));
  describe_base(motor, result);
  const CrossValidatedFit& fit = motor.search.base;
  result.localised = shares(*motor.search.data, fit, fit.residual_fixed_effects());
  result.remaining_structure = shares(*motor.search.data, fit, fit.residual);
  result.unknown.reset();
}

void explain_orders(const model::Drive& drive, Diagnosis& result) {
  for (Candidate& c : result.candidates) {
    const catalogue::Entry* entry = catalogue::find(c.effect);
    if (!c.order || entry == nullptr) continue;
    c.order_causes = catalogue::order_causes(*entry, *c.order, drive);
    c.order_hint = catalogue::order_hint(*entry, drive);
  }
}

void list_candidates(std::vector<SearchedBalance>& all, data::Axis axis, Diagnosis& result) {
  for (SearchedBalance& e : all) {
    const DetectionLimit detection(e.search);
    std::vector<std::optional<Detectable>> smallest(e.candidates.size());
    estimation::in_parallel(e.candidates.size(),
                            [&](std::size_t i) { smallest[i] = detection.smallest(e.candidates[i]); });
    for (std::size_t i = 0; i < e.candidates.size(); ++i) {
      const CandidateFit& t = e.candidates[i];
      result.candidates.push_back(candidate_of(t, e.search, axis));
      result.candidates.back().minimum_detectable = std::move(smallest[i]);
      if (t.confounded_with.empty()) continue;
      result.candidates.back().confounding_reasons.push_back(compare_with_model(e.search, t));
      result.warnings.push_back(
          fmt::format("{0} cannot be distinguished from {1} in these data: {1} is named for what both share; {2} would "
                      "separate them",
                      t.model.entry->name(), t.confounded_with, t.model.entry->info->separated_by));
    }
  }
  std::stable_sort(result.candidates.begin(), result.candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.admissible != b.admissible ? a.admissible
                                        : a.score + a.other_balance_score > b.score + b.other_balance_score;
  });
}

std::string drift_text(const Drift& drift, const estimation::PreparedData& prepared) {
  const bool has_temperature = std::any_of(prepared.records.begin(), prepared.records.end(),
                                           [](const estimation::Record& r) { return r.has_temperature; });
  return fmt::format(
      "{} differs between runs by {:.1f} %, which the model does not explain. {} An effect that shows only from run to "
      "run counts for less then; repeat one motion from time to time",
      drift.group, drift.percent,
      has_temperature ? "The temperature is recorded: see whether an effect of it is named or possible."
                      : "The usual cause is the temperature, which is not recorded: log it.");
}

// What to do about a delay of the effort against the motion; empty where it is within what the alignment leaves open.
std::string delay_advice(double delay_s, const estimation::PreparedData& prepared) {
  constexpr double kSure = 0.25, kMoreThanHold = 0.75;  // samples
  double longest_s = 0.0;
  for (const estimation::Record& r : prepared.records) longest_s = std::max(longest_s, r.sample_s);
  const double samples = std::abs(delay_s) / std::max(longest_s, 1e-300);
  if (samples < kSure) return {};
  const bool is_held = std::any_of(prepared.records.begin(), prepared.records.end(), [](const estimation::Record& r) {
    return r.experiment->current_hold == data::CurrentHold::zoh;
  });
  const std::string what = fmt::format("The effort {} the motion by {:.3g} ms ({:.2g} samples)",
                                       delay_s > 0.0 ? "lags" : "leads", 1e3 * std::abs(delay_s), samples);
  if (delay_s > 0.0 && samples < kMoreThanHold && is_held)
    return what +
           ": it was moved by half a sample, as if the drive held it from sample to sample. If yours does not, state "
           "current_hold = \"none\" in dataset.toml.";
  return what + (delay_s > 0.0 ? " beyond the alignment: check the time stamps and filters of the log."
                               : " beyond the alignment: it acts later than it is logged, as a commanded current does "
                                 "(current_delay), or the time stamps differ.");
}

void add_drifts(const SearchedBalance& balance, const CrossValidatedFit& fit, Diagnosis& result) {
  for (const Drift& d : drifts(fit)) {
    result.friction_drift.push_back(d);
    result.warnings.push_back(drift_text(d, balance.search.data->prepared()));
  }
}

// What is left, with the named effect in the model if there is one.
void assess_remainder(const SearchedBalance& chosen, Diagnosis& result) {
  const CrossValidatedFit& after = result.named.empty() ? chosen.search.base : chosen.candidates.front().fit;
  // A missing effect may look like a delay, so the delay is taken from the better model. Where a delay is named, it
  // says how large it is.
  const bool names_delay = std::any_of(result.named.begin(), result.named.end(), [](const NamedEffect& n) {
    return is_delay_of_current(catalogue::get(n.effect));
  });
  const Eigen::Index delay = after.theta.size() - 1;
  if (chosen.search.data->balance() == estimation::Balance::motor && !names_delay &&
      std::abs(after.theta[delay]) > kPolicy.delay_errors * after.std[delay])
    result.delay_s = after.theta[delay];
  add_drifts(chosen, after, result);
  const bool at_floor = result.noise_floor && after.rmse() < kPolicy.at_floor * *result.noise_floor;
  bool enough = true;
  if (result.noise_floor && !result.named.empty()) {
    const auto above = [&](const CrossValidatedFit& j) {
      return j.rmse() * j.rmse() - *result.noise_floor * *result.noise_floor;
    };
    if (above(chosen.search.base) > 0.0)
      result.recovered_percent = std::clamp(100.0 * (1.0 - above(after) / above(chosen.search.base)), 0.0, 100.0);
    enough = at_floor || result.recovered_percent.value_or(100.0) >= kPolicy.recovered_percent;
  }
  const std::vector<LocalisedResidual> remaining =
      shares(*chosen.search.data, after, after.residual,
             enough ? kPolicy.shown_share_percent : kPolicy.least_shown_share_percent);
  if (!at_floor) result.remaining_structure = remaining;
  if (!result.named.empty()) return;
  if (at_floor)
    result.verdict = Verdict::at_noise_floor;
  else
    result.verdict =
        result.noise_floor && !remaining.empty() ? Verdict::unknown_structure : Verdict::nothing_significant;
}

// Friction differs between records on the motor's balance, whichever one was judged.
void look_between_records(const estimation::Identification& base, const estimation::Identification& all_records,
                          const SearchedBalance& judged, const SearchedBalance& motor, Diagnosis& result) {
  const bool is_other = &judged != &motor;
  if (is_other) add_drifts(motor, motor.search.base, result);
  name_between_records(base, all_records, motor, result);
  if (is_other && !result.named.empty()) describe_motor_instead(judged, motor, result);
}

// Whether the data could show anything at all.
void assess_excitation(bool moves, Diagnosis& result) {
  if (result.resampling && result.resampling->too_little)
    result.warnings.push_back(
        "these data have too few samples to choose effects on halves of them; record longer, with several strokes");
  if (!moves || (result.resampling && result.resampling->too_little)) result.verdict = Verdict::insufficient_excitation;
}

// What halves of the data choose on the motor's balance, held-out experiments kept for the check.
Resampling resample_motor(const data::Dataset& dataset, const estimation::Identification& base,
                          const SearchedBalance& motor) {
  std::vector<const data::Experiment*> with_held_out = of_role(dataset, data::Role::fit);
  for (const data::Experiment* e : of_role(dataset, data::Role::holdout)) with_held_out.push_back(e);
  Resampling result = resample(with_held_out, base.model.drive, base.terms);
  take_likelier_waves(result, motor);
  add_identical_effects(result, motor);
  add_effects_of_angle(result, motor);
  return result;
}

// At the cut-off and the mask of the options.
Diagnosis diagnose_at(const data::Dataset& dataset, const model::Model& model, const Options& options) {
  Diagnosis result;
  result.unit = model.drive.axis == data::Axis::linear ? "N" : "N*m";
  if (options.progress) options.progress("fitting the model");
  const auto base = estimation::identify(dataset, model, options.pipeline);
  result.warnings = base->warnings;
  result.parameter_trends = parameter_trends(*base);
  std::vector<SearchedBalance> all = search_balances(*base, dataset, options, result);
  const bool moves = std::any_of(base->prepared.records.begin(), base->prepared.records.end(),
                                 [](const estimation::Record& r) { return !r.at_rest; });
  const auto motor = std::find_if(all.begin(), all.end(), [](const SearchedBalance& e) {
    return e.search.data->balance() == estimation::Balance::motor;
  });
  if (moves && motor != all.end()) {
    if (options.progress) options.progress("choosing effects on halves of the data");
    result.resampling = resample_motor(dataset, *base, *motor);
  }
  const bool decides = result.resampling && resampling_decides(*result.resampling, *motor);
  const bool is_motor_first = base->prepared.pipeline.keep_torsion_reversals && motor != all.end() &&
                              (decides ? names_any(*result.resampling, *motor) : motor->names_one());
  SearchedBalance& chosen = is_motor_first ? *motor : most_significant(all, decides ? result.resampling : std::nullopt);
  const bool by_resampling = decides && &chosen == &*motor;
  if (result.resampling) result.resampling->decides = by_resampling;
  std::string alias;
  if (chosen.names_one() && !by_resampling) {
    if (options.progress) options.progress("checking what else could explain it");
    alias = choose_named(chosen);
  }
  describe_base(chosen, result);
  // Where nothing is missing, friction that differs between runs is not a structure to search for.
  const bool names_one = chosen.names_one() && !by_resampling;
  const CrossValidatedFit& fit = chosen.search.base;
  result.localised =
      shares(*chosen.search.data, fit, names_one || by_resampling ? fit.residual_fixed_effects() : fit.residual);
  list_candidates(all, model.drive.axis, result);
  if (by_resampling) name_stable(chosen, result);
  if (names_one) name_by_likelihood(chosen, alias, result);
  take_back_insignificant(result);
  const bool tests_between_records = decides && (by_resampling || result.named.empty());
  const std::unique_ptr<AllRecords> all_records =
      tests_between_records ? fit_all_records(*motor, dataset, model, options.pipeline) : nullptr;
  const estimation::Identification& of_all_records = all_records ? *all_records->fitted : *base;
  if (by_resampling) take_back_unconfirmed_scaling(of_all_records, chosen, result);
  if (!result.named.empty()) explain_named(chosen.search, chosen.candidates, model.drive, result);
  assess_remainder(chosen, result);
  if (by_resampling && result.resampling->lag_s) result.delay_s = result.resampling->lag_s;
  if (result.delay_s) result.delay_advice = delay_advice(*result.delay_s, base->prepared);
  if (!by_resampling || result.named.empty()) {
    if (options.progress) options.progress("looking for what no effect explains");
    check_unknown_structure(chosen.search, names_one ? &chosen.candidates.front() : nullptr, result);
  }
  if (tests_between_records) look_between_records(*base, of_all_records, chosen, *motor, result);
  name_on_other_balances(all, *result.balance == estimation::Balance::motor ? *motor : chosen, model.drive, result);
  take_back_insignificant(result);
  explain_orders(base->model.drive, result);
  assess_excitation(moves, result);
  return result;
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
  if (!options.pipeline.cutoff_hz && options.pipeline.mask) return diagnose_at(dataset, model, options);
  const Diagnosis stated = diagnose_at(dataset, model, options);
  Options automatic = options;
  automatic.pipeline.cutoff_hz.reset();
  automatic.pipeline.mask = true;
  automatic.pipeline.ready = nullptr;
  Diagnosis result = diagnose_at(dataset, model, automatic);
  result.at_stated_setting = {stated.verdict, stated.named};
  return result;
}

}  // namespace flexspline::selection
