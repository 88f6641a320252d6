#include "host/engine/selection/diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "host/engine/comparison/noise_floor.hpp"
#include "host/engine/estimation/modelled_current.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/balance_errors.hpp"
#include "host/engine/selection/between_records.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/deciding_method.hpp"
#include "host/engine/selection/described_candidates.hpp"
#include "host/engine/selection/disturbances.hpp"
#include "host/engine/selection/encoder_errors.hpp"
#include "host/engine/selection/friction_scaling.hpp"
#include "host/engine/selection/group_members.hpp"
#include "host/engine/selection/held_out.hpp"
#include "host/engine/selection/named_by_resampling.hpp"
#include "host/engine/selection/named_delay.hpp"
#include "host/engine/selection/named_on_balances.hpp"
#include "host/engine/selection/other_balance_evidence.hpp"
#include "host/engine/selection/output_angle_period.hpp"
#include "host/engine/selection/presliding_fit.hpp"
#include "host/engine/selection/record_cross_validation.hpp"
#include "host/engine/selection/record_inertia.hpp"
#include "host/engine/selection/refitted_names.hpp"
#include "host/engine/selection/remainder.hpp"
#include "host/engine/selection/resampling.hpp"
#include "host/engine/selection/searched_balance.hpp"
#include "host/engine/selection/significance_checks.hpp"
#include "host/engine/selection/wald_test.hpp"

namespace flexspline::selection {
namespace {

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

void report(const Options& options, std::string_view stage) {
  if (options.progress) options.progress(stage);
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
    report(options, fmt::format("trying effects ({} of {} balances)", all.size() + 1, base.data.size()));
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
    check_output_angle_period(one.search, one.candidates);
    check_encoder_errors(one.search, one.candidates);
    if (one.search.data->balance() == estimation::Balance::motor)
      one.held_out = std::make_unique<HeldOut>(dataset, base, estimation::Balance::motor, options.pipeline.ready.get());
    check_first(one);
  }
  for (SearchedBalance& one : all)
    if (discount_evidence(all, one)) check_first(one);
  return all;
}

// An effect that is nonlinear in the current, and passes with the current that the model makes of the motion, is no
// noise of the measured one: its values, and what it takes off, come from that. The model lacks the effect, and so
// makes a current that is too small where the effect is strong; a limit of the current would do better then.
bool take_measured_current(const std::vector<SearchedBalance>& all, estimation::Identification& base) {
  const auto passes_by_model = [](const CandidateFit& candidate) {
    return passes(candidate) && estimation::is_nonlinear_in_current(candidate.fit.terms.back());
  };
  if (!base.prepared.effort_is_current || std::ranges::none_of(all, [&](const SearchedBalance& e) {
        return std::ranges::any_of(e.candidates, passes_by_model);
      }))
    return false;
  base.prepared.nonlinear_in_measured_current = true;
  for (RegressionProblem& data : base.data) data = RegressionProblem(base.prepared, data.balance());
  return true;
}

// The balance that the verdict is about, and the method that names its effects.
struct ChosenBalance {
  SearchedBalance* balance = nullptr;
  SearchedBalance* motor = nullptr;          // null: not in the data
  Method method = Method::likelihood;        // on that balance
  Method motor_method = Method::likelihood;  // on the motor's, whichever is chosen
  bool moves = false;                        // any record; else friction cannot show
};

// The balance whose named effect scores best; where none is named, the one that is highest above its floor. A torsion
// that is hardly above its noise shows errors of the encoders before anything else, so that its balance comes last.
SearchedBalance& most_significant(std::vector<SearchedBalance>& all, const ChosenBalance& chosen,
                                  const std::optional<Resampling>& resampling) {
  const auto importance = [&](const SearchedBalance& e) {
    const RegressionProblem& data = *e.search.data;
    const bool is_noisy =
        data.balance() == estimation::Balance::transmission && data.prepared().pipeline.keep_torsion_reversals;
    const bool is_by_resampling = &e == chosen.motor && chosen.motor_method == Method::resampling;
    const bool names_one = is_by_resampling ? names_any(*resampling, e) : e.names_one();
    if (names_one && !e.candidates.empty()) return (is_noisy ? 1e9 : 2e9) + e.candidates.front().score();
    return e.floor.rmse ? e.search.base.rmse() / *e.floor.rmse : 0.0;
  };
  return *std::ranges::max_element(all, {}, importance);
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

// Chooses the balance and the method. What halves of the data found goes into the result.
ChosenBalance choose_balance(std::vector<SearchedBalance>& all, const estimation::Identification& base,
                             const data::Dataset& dataset, const Options& options, Diagnosis& result) {
  ChosenBalance chosen;
  chosen.moves = std::ranges::any_of(base.prepared.records, [](const estimation::Record& r) { return !r.at_rest; });
  for (SearchedBalance& e : all)
    if (e.search.data->balance() == estimation::Balance::motor) chosen.motor = &e;
  bool motor_names_one = false;
  if (chosen.motor) {
    motor_names_one = chosen.motor->names_one();
    if (chosen.moves) {
      report(options, "choosing effects on halves of the data");
      result.resampling = resample_motor(dataset, base, *chosen.motor);
      chosen.motor_method = deciding_method(*result.resampling, *chosen.motor);
      if (chosen.motor_method == Method::resampling) motor_names_one = names_any(*result.resampling, *chosen.motor);
    }
  }
  const bool is_motor_first = base.prepared.pipeline.keep_torsion_reversals && motor_names_one;
  chosen.balance = is_motor_first ? chosen.motor : &most_significant(all, chosen, result.resampling);
  if (chosen.balance == chosen.motor) chosen.method = chosen.motor_method;
  if (result.resampling) result.resampling->decides = chosen.method == Method::resampling;
  return chosen;
}

// Names what the chosen balance lacks. Returns the candidate that likelihood named; null: it named none.
const CandidateFit* name_effects(std::vector<SearchedBalance>& all, const ChosenBalance& chosen, const Options& options,
                                 const model::Drive& drive, Diagnosis& result) {
  SearchedBalance& balance = *chosen.balance;
  const bool by_resampling = chosen.method == Method::resampling;
  std::string alias;
  if (balance.names_one() && !by_resampling) {
    report(options, "checking what else could explain it");
    alias = choose_named(balance);
  }
  const bool by_likelihood = balance.names_one() && !by_resampling;
  describe_base(balance, result);
  // Where nothing is missing, friction that differs between runs is not a structure to search for.
  const CrossValidatedFit& fit = balance.search.base;
  result.localised =
      shares(*balance.search.data, fit, by_likelihood || by_resampling ? fit.residual_fixed_effects() : fit.residual);
  list_candidates(all, drive.axis, result);
  if (by_resampling) name_stable(balance, result);
  if (by_likelihood) name_by_likelihood(balance, alias, result);
  if (chosen.balance == chosen.motor) name_delay(balance, drive, result);
  // Presliding has its travel and its errors after refit_presliding alone.
  take_back_insignificant(result, false);
  return by_likelihood ? &balance.candidates.front() : nullptr;
}

// The delay of the effort that halves of the data agree on, and what to do about it.
void assess_delay(const ChosenBalance& chosen, const estimation::PreparedData& prepared, Diagnosis& result) {
  // Beside a delay of the model's own, a lag is not known.
  if (estimation::has_delay_of_current(chosen.balance->search.base.terms)) {
    result.delay_s.reset();
    return;
  }
  if (chosen.method == Method::resampling && result.resampling->lag_s) result.delay_s = result.resampling->lag_s;
  if (!result.delay_s) return;
  result.delay_advice = delay_advice(*result.delay_s, prepared);
  const bool is_more_missing =
      result.verdict == Verdict::nothing_significant || result.verdict == Verdict::unknown_structure;
  if (is_more_missing && !result.delay_advice.empty())
    result.delay_advice += " What the model lacks may look like it, too.";
}

// Friction differs between records on the motor's balance, whichever one was chosen.
void look_between_records(const estimation::Identification& base, const estimation::Identification& all_records,
                          const ChosenBalance& chosen, Diagnosis& result) {
  const SearchedBalance& motor = *chosen.motor;
  const bool is_other = chosen.balance != chosen.motor;
  if (is_other) add_drifts(motor, motor.search.base, result);
  name_between_records(base, all_records, motor, result);
  if (is_other && !result.named.empty()) describe_motor_instead(*chosen.balance, motor, result);
}

// Whether the data could show anything at all.
void assess_excitation(bool moves, Diagnosis& result) {
  const bool has_too_little = result.resampling && result.resampling->too_little;
  if (has_too_little)
    result.warnings.push_back(
        "these data have too few samples to choose effects on halves of them; record longer, with several strokes");
  if (!moves || has_too_little) result.verdict = Verdict::insufficient_excitation;
  const double times = std::pow(result.base_rmse_cv / result.base_rmse, 2);
  if (!moves || !(times > kPolicy.most_left_out_squares)) return;
  const std::string why = fmt::format(
      "in cross-validation the model alone has {:.3g} times the squared error: too few independent samples for "
      "its parameters",
      times);
  for (const NamedEffect& name : result.named) result.possible.push_back({{name}, why, std::nullopt, std::nullopt});
  result.named.clear();
  result.unknown.reset();
  result.partial = false;
  result.warnings.push_back(why + "; record longer, with several strokes, and slow and fast motion");
  result.verdict = Verdict::insufficient_excitation;
}

// Effects of the current are no candidates where the effort is a torque, which often is a current times a constant.
void list_untried(const estimation::PreparedData& prepared, Diagnosis& result) {
  const bool lacks_more = result.partial || (result.named.empty() && result.verdict != Verdict::at_noise_floor);
  if (prepared.effort_is_current || !lacks_more) return;
  std::string names;
  for (const catalogue::Entry& entry : catalogue::all())
    if (entry.info->reads == effects::kCurrent && entry.info->balance == estimation::Balance::motor)
      names += fmt::format("{}{}", names.empty() ? "" : ", ", entry.name());
  result.untried_advice = fmt::format(
      "Effects of the current were not tried ({}), as the effort is a torque. If it was logged as a current times a "
      "constant, map it as current_a and state torque_constant_nm_a.",
      names);
}

// Names that the last steps took back leave a verdict that is not theirs.
void follow_taken_back(std::vector<SearchedBalance>& all, const SearchedBalance& chosen, const CandidateFit* likeliest,
                       Diagnosis& result) {
  const auto described =
      std::ranges::find_if(all, [&](const SearchedBalance& e) { return e.search.data->balance() == result.balance; });
  if (described != all.end() && follow_names(*described, result))
    check_unknown_structure(described->search, &*described == &chosen ? likeliest : nullptr, result);
}

// The steps depend on each other through `result`:
//   name_effects                   writes verdict, balance, errors, candidates, named, possible, partial
//   take_back_unconfirmed_scaling  reads named and verdict; takes names back
//   explain_named                  reads named; writes evidence and size of their candidates
//   assess_remainder               reads named; writes verdict (where nothing is named), delay, drift, recovered share
//   check_unknown_structure        reads named; may replace verdict and names, or set partial
//   look_between_records           reads named; may name what differs between records, and the motor's balance with it
//   name_on_other_balances         reads named and verdict; appends names of the other balances
//   refit_presliding, take_back_insignificant, take_back_where_refit_holds_zero   change values and names by what was
//                                  found before
//   follow_taken_back              reads named; writes verdict where a name was taken back, and may find a structure
// At the cut-off and the mask of the options: fits the model, chooses the balance where most is missing, names what it
// lacks, tests the names against what differs between records, and says what is left.
Diagnosis diagnose_at(const data::Dataset& dataset, const model::Model& model, const Options& options) {
  Diagnosis result;
  result.unit = model.drive.axis == data::Axis::linear ? "N" : "N*m";
  report(options, "fitting the model");
  const auto base = estimation::identify(dataset, model, options.pipeline);
  result.warnings = base->warnings;
  result.parameter_trends = parameter_trends(*base);
  estimation::take_modelled_current(base->prepared, base->terms);
  // Columns that were formed before are of the measured current.
  if (std::ranges::any_of(base->terms, estimation::reads_modelled_current))
    for (RegressionProblem& data : base->data) data = RegressionProblem(base->prepared, data.balance());
  std::vector<SearchedBalance> all = search_balances(*base, dataset, options, result);
  if (take_measured_current(all, *base)) {
    result.disturbances.clear();
    result.warnings = base->warnings;
    all = search_balances(*base, dataset, options, result);
  }
  const ChosenBalance chosen = choose_balance(all, *base, dataset, options, result);
  if (chosen.motor)
    if (const auto own = inertia_by_record(*base, chosen.motor->search)) result.warnings.push_back(inertia_text(*own));
  SearchedBalance& balance = *chosen.balance;
  const bool by_resampling = chosen.method == Method::resampling;
  const CandidateFit* likeliest = name_effects(all, chosen, options, model.drive, result);

  const bool tests_between_records =
      chosen.motor_method == Method::resampling && (by_resampling || result.named.empty());
  const std::unique_ptr<AllRecords> all_records =
      tests_between_records ? fit_all_records(*chosen.motor, dataset, model, options.pipeline) : nullptr;
  const estimation::Identification& of_all_records = all_records ? *all_records->fitted : *base;
  if (by_resampling) take_back_unconfirmed_scaling(of_all_records, balance, result);
  if (!result.named.empty()) explain_named(balance.search, balance.candidates, model.drive, result);

  assess_remainder(balance, result);
  assess_delay(chosen, base->prepared, result);
  if (!by_resampling || result.named.empty()) {
    report(options, "looking for what no effect explains");
    check_unknown_structure(balance.search, likeliest, result);
  }
  if (tests_between_records) look_between_records(*base, of_all_records, chosen, result);
  name_on_other_balances(all, *result.balance == estimation::Balance::motor ? *chosen.motor : balance, model.drive,
                         result);
  list_waves_of_uncertain_period(all, result);
  refit_presliding(dataset, model, options, chosen.motor, result);
  take_back_insignificant(result);
  take_back_where_refit_holds_zero(dataset, model, options.pipeline, result);
  follow_taken_back(all, balance, likeliest, result);
  explain_orders(base->model.drive, result);
  assess_excitation(chosen.moves, result);
  list_untried(base->prepared, result);
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
