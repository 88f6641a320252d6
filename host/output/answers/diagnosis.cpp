#include "host/output/answers/diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "host/engine/selection/wald_test.hpp"
#include "host/output/answers/disturbance_text.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/explanation.hpp"
#include "host/output/answers/identification.hpp"
#include "host/output/answers/learned_table.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::output {
namespace {

using selection::Candidate;
using selection::Diagnosis;
using selection::Verdict;

constexpr std::size_t kRowsShown = 10;
// Errors that differ by less are reported as equal.
constexpr double kRunFrictionMatters = 0.95;

// The squared error that a term takes off may be more than what is above the noise, which is an estimate.
double clipped(double share_percent) {
  return std::clamp(share_percent, 0.0, 100.0);
}

// A share above zero is not called 0 %.
std::string percent(double share) {
  return share > 0.0 && share < 1.0 ? "less than 1" : fmt::format("{:.0f}", share);
}

std::string evidence(const Diagnosis& d) {
  std::string text;
  if (d.balance) text += fmt::format("{} balance: ", catalogue::balance_name(*d.balance));
  text += fmt::format("error {}, {} on data left out of the fit", with_unit(d.base_rmse, d.unit),
                      with_unit(d.base_rmse_cv, d.unit));
  // What other commands, which leave neither out, count as error.
  if (!d.delay_advice.empty())
    text += d.reversals_left_out ? ", both without reversals and without the delay of the effort"
                                 : ", both without the delay of the effort";
  else if (d.reversals_left_out)
    text += ", both without reversals";
  if (d.noise_floor)
    text += fmt::format("; noise {} (from {}), so the error is {:.3g} times the noise",
                        with_unit(*d.noise_floor, d.unit), d.noise_floor_from, d.base_rmse / *d.noise_floor);
  else if (d.noise_of_some)
    text += fmt::format("; the noise is known in {} only: {} (from {}), where the error is {:.3g} times that",
                        listed(d.noise_of_some->records), with_unit(d.noise_of_some->noise, d.unit),
                        d.noise_of_some->from, d.noise_of_some->rmse / d.noise_of_some->noise);
  else
    text += "; noise not known (state noise_std_COLUMN in dataset.toml, or record a periodic motion)";
  // What is named may pass for friction that differs; only where nothing is, the difference is the runs' own.
  if (d.named.empty() && d.base_rmse_own_friction < kRunFrictionMatters * d.base_rmse)
    text += fmt::format("; with friction that is each run's own {}{}", with_unit(d.base_rmse_own_friction, d.unit),
                        d.noise_floor ? fmt::format(", {:.3g} times", d.base_rmse_own_friction / *d.noise_floor) : "");
  return text;
}

std::string shares(const std::vector<selection::LocalisedResidual>& parts) {
  std::vector<std::string> texts;
  // Signals go together in any motion; the first few are enough.
  for (const selection::LocalisedResidual& part : std::span(parts).first(std::min<std::size_t>(3, parts.size())))
    texts.push_back(fmt::format("{} {:.1f} %", part.variable, part.share_percent));
  return listed(texts);
}

// "2.4 %": root mean square of the error over that of the measured side of the balance.
std::string share_of_target(const Diagnosis& d) {
  return d.target_rms > 0.0 ? fmt::format("{:.2g} %", 100.0 * d.base_rmse / d.target_rms) : "a part";
}

std::string explained_in_words(double percent) {
  constexpr double kLeast = -100.0;  // beyond, it only says that the fit was left
  return percent < kLeast ? "< -100 %" : fmt::format("{:.1f} %", percent);
}

std::string candidate_table(const Diagnosis& d, const model::Drive* drive) {
  Table table({"", "candidate", "balance", "score", "explains", "error before", "after", "", "smallest detectable", ""},
              "rllrrrrlll");
  std::size_t rank = 0;
  for (const Candidate& c : d.candidates) {
    if (++rank > kRowsShown) break;
    table.row({fmt::format("{}", rank), effect_label(c.effect, c.order), catalogue::balance_name(c.balance),
               number(c.score), explained_in_words(c.chi2_decrease_percent), number(c.rmse_cv_before),
               number(c.rmse_cv_after), d.unit, detectable_in_words(c, drive),
               c.admissible ? "" : "refused: " + c.why_not});
  }
  return table.text();
}

const Candidate* candidate_of(const Diagnosis& d, const selection::NamedEffect& named) {
  for (const Candidate& c : d.candidates)
    if (selection::NamedEffect{c.effect, c.order} == named) return &c;
  return nullptr;
}

std::string replaced(std::string text, std::string_view what, const std::string& by) {
  const std::size_t at = text.find(what);
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

// Of the points that rows reach, the standard error of the one in the middle.
double typical_error(const estimation::LearnedTable& curve) {
  std::vector<double> errors;
  for (std::size_t k = 0; k < curve.table.std.size(); ++k)
    if (curve.visited[k]) errors.push_back(curve.table.std[k]);
  if (errors.empty()) return 0.0;
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  return errors[errors.size() / 2];
}

void print_next(Console& console, const Diagnosis& d, const std::string& add_command) {
  std::vector<std::string> steps;
  switch (d.verdict) {
    case Verdict::missing_effect:
    case Verdict::confusable_effects:
      for (const selection::NamedEffect& n : d.named)
        if (const Candidate* c = candidate_of(d, n); c == nullptr || c->admissible)
          steps.push_back(replaced(add_command, "EFFECT", effect_label(n.effect, n.order)));
      if (d.verdict == Verdict::confusable_effects && d.named.size() > 1)
        steps.push_back(fmt::format(
            "flexspline plan --separate {},{} --help   shows how to record what distinguishes them",
            effect_label(d.named[0].effect, d.named[0].order), effect_label(d.named[1].effect, d.named[1].order)));
      if (d.verdict == Verdict::missing_effect && !steps.empty() && (d.partial || !d.possible.empty()))
        steps.push_back("diagnose again with that model, as a large effect hides smaller ones; --auto does both");
      break;
    case Verdict::unknown_structure:
      if (d.unknown)
        steps.push_back(fmt::format("{} --balance {}", replaced(add_command, "EFFECT", d.unknown->effect),
                                    d.unknown->definition.balance));
      steps.push_back("flexspline compare shows in which region the error is large; examine the drive there");
      break;
    case Verdict::insufficient_excitation:
      steps.push_back(
          "record slow and fast motion in both directions; flexspline identify names what cannot be identified");
      break;
    case Verdict::at_noise_floor:
    case Verdict::nothing_significant:
      break;
  }
  if (steps.empty()) return;
  console.line();
  console.line("Next:");
  for (const std::string& step : steps) console.line("  " + step);
}

void print_unknown(Console& console, const Diagnosis& d) {
  const selection::UnknownStructure& u = *d.unknown;
  console.line();
  console.line(
      wrapped(fmt::format("It depends on {}{}: a curve over it reduces the squared error on data left out of the fit "
                          "by {:.1f} % (score {:.0f}). At the points that the data reach it is known to {}.",
                          u.definition.variable, u.definition.times_direction ? ", times the direction of motion" : "",
                          u.curve.decrease_percent, u.curve.score, with_unit(typical_error(u.curve), d.unit))));
  if (u.named_share_percent && !d.candidates.empty())
    console.line(wrapped(
        fmt::format("The nearest effect of the catalogue, {}, explains {:.0f} % of what the curve does.",
                    effect_label(d.candidates.front().effect, d.candidates.front().order), *u.named_share_percent)));
  std::vector<std::string> others;
  for (std::size_t k = 1; k < std::min<std::size_t>(4, u.depends_on.size()); ++k)
    others.push_back(fmt::format("{} {:.1f} %", u.depends_on[k].variable, u.depends_on[k].decrease_percent));
  if (!others.empty())
    console.line(wrapped(fmt::format("Curves over other signals, which may go along with it: {}.", listed(others))));
  console.line(curve_text(curve_of_table(u.definition, u.curve.table, d.unit), takes_braille()));
  console.line(wrapped(fmt::format("Record next: {}.", u.record_next)));
}

std::string stated_setting_text(const selection::StatedSetting& stated) {
  std::string names;
  for (const selection::NamedEffect& n : stated.named)
    names += (names.empty() ? "" : ", ") + (n.order ? fmt::format("{}:{:g}", n.effect, *n.order) : n.effect);
  return fmt::format(
      "The verdict is made at the cut-off and the mask that the data give. The stated ones alone would name {}: a name "
      "that depends on them is not certain.",
      names.empty() ? "nothing" : names);
}

std::string law_in_range_text(const selection::LawInRange& law) {
  return fmt::format(
      "Friction of the {} records with an rms speed of {:.3g} to {:.3g} {} differs between them as {} says (p = "
      "{:.2g}, {:.0f} % of its variance). Over all {} records it does not (p = {:.2g}), so it is not named: what the "
      "others lack is something else, or the law ends there. Record one motion over the whole range of speeds.",
      law.records, law.lowest_speed, law.highest_speed, law.speed_unit, listed(law.effects, "or"), law.p_value,
      law.explained_percent, law.of_records, law.p_value_of_all);
}

}  // namespace

std::string effect_label(const std::string& effect, const std::optional<double>& order) {
  return order ? fmt::format("{}:{:g}", effect, *order) : effect;
}

std::string effect_in_words(const std::string& effect, const std::optional<double>& order) {
  return order ? fmt::format("{} ({:g} per turn)", effect, *order) : effect;
}

std::string verdict_in_words(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const selection::NamedEffect& n : d.named) names.push_back(effect_in_words(n.effect, n.order));
  switch (d.verdict) {
    case Verdict::missing_effect:
      return fmt::format("The model lacks {}.", listed(names));
    case Verdict::confusable_effects:
      return fmt::format("The model lacks one of {}; these data cannot show which.", listed(names, "or"));
    case Verdict::at_noise_floor:
      if (!d.possible.empty())
        return "No effect can be named: the model's error is the noise of the measurement. What may be missing is "
               "below.";
      if (d.base_rmse_own_friction < kRunFrictionMatters * d.base_rmse)
        return "Nothing is missing: friction differs from run to run, and otherwise the model's error is the noise "
               "of the measurement.";
      return "Nothing is missing: the model's error is the noise of the measurement.";
    case Verdict::nothing_significant: {
      const bool is_more_below = !d.possible.empty() || (d.resampling && !d.resampling->found.empty());
      if (is_more_below)
        return fmt::format("No effect of the catalogue can be named; what may be missing is below. The {}.",
                           d.noise_floor     ? "model's error is above the noise of the measurement"
                           : d.noise_of_some ? "noise level is known in some records only"
                                             : "noise level is not known");
      if (d.noise_floor)
        return fmt::format(
            "No effect of the catalogue improves the model. Its error is {:.2g} times the noise of the measurement, "
            "but "
            "depends on no measured signal.",
            d.base_rmse / *d.noise_floor);
      return fmt::format(
          "No effect of the catalogue improves the model. It leaves {} of the {} balance's measured side; how much of "
          "that is noise is {}.",
          share_of_target(d), catalogue::balance_name(d.balance.value_or(estimation::Balance::motor)),
          d.noise_of_some ? "known in some records only" : "not known");
    }
    case Verdict::unknown_structure:
      return d.possible.empty() ? "Something is missing that no effect of the catalogue explains."
                                : "Something is missing. No effect of the catalogue explains it for certain; what may "
                                  "explain it is below.";
    case Verdict::insufficient_excitation:
      return "These data do not excite the drive enough to show it.";
  }
  return {};
}

// The result on the experiments that are held out. They decide whether an effect is named, so that their error is no
// proof of the gain.
void print_held_out(Console& console, const selection::Resampling& r) {
  std::vector<std::string> better, worse;
  for (const selection::Resampling::FoundTerm& f : r.found) {
    if (!f.held_out_ratio || f.group.empty()) continue;
    const std::string name = effect_in_words(f.group.front().effect, f.group.front().order);
    (f.refused_by_holdout ? worse : better).push_back(fmt::format("{} {:.3f}", name, *f.held_out_ratio));
  }
  if (better.empty() && worse.empty()) return;
  std::string text = "Error on the experiments that are held out, with the effect over without it: ";
  text += listed(better.empty() ? worse : better);
  if (!better.empty() && !worse.empty()) text += fmt::format("; {}", listed(worse));
  text += worse.empty() ? "."
                        : fmt::format(". It rises with {}, so {} not named.", listed(worse),
                                      worse.size() > 1 ? "these are" : "that is");
  console.line(wrapped(text +
                       " As it was used to decide, it does not prove the gain: test that with `compare` on data of a "
                       "later measurement."));
}

// Of a structure that no single effect of the catalogue explains best.
std::string name_outside_catalogue(const std::string& name) {
  const bool are_several = name.find(" or ") != std::string::npos;
  return name + (are_several ? ", which these data cannot distinguish," : ", which is in no catalogue,");
}

void print_resampling(Console& console, const selection::Resampling& r) {
  std::vector<std::string> found;
  for (const selection::Resampling::FoundTerm& f : r.found) {
    std::vector<std::string> names;
    for (const selection::NamedEffect& n : f.group) names.push_back(effect_in_words(n.effect, n.order));
    found.push_back(fmt::format("{} in {:.0f} of 100 ({} % of the squared error above the noise, {:.0f} to {:.0f} %)",
                                names.empty() ? name_outside_catalogue(f.name) : listed(names, "or"),
                                100.0 * f.frequency, percent(clipped(f.share_percent)), clipped(f.share_low_percent),
                                clipped(f.share_high_percent)));
  }
  const std::string how =
      fmt::format("{:.0f} subsamples at bandwidths from {:.3g} to {:.3g} Hz, with and without reversals", r.subsamples,
                  r.lowest_hz, r.highest_hz);
  console.line(wrapped(found.empty() ? fmt::format("Nothing is chosen often enough in {}.", how)
                                     : fmt::format("Of {}: {}.", how, listed(found))));
  print_held_out(console, r);
}

std::string words(const std::vector<selection::NamedEffect>& group) {
  std::vector<std::string> names;
  for (const selection::NamedEffect& n : group) names.push_back(effect_in_words(n.effect, n.order));
  return listed(names, "or");
}

// What to record where an effect is neither shown nor ruled out.
std::string what_decides(const Diagnosis& d, const selection::NamedEffect& effect) {
  if (const Candidate* c = candidate_of(d, effect); c && !selection::doubt_about_presliding(*c).empty())
    return "slower reversals, or the same at a higher sample rate or with a finer encoder";
  const catalogue::Entry* entry = catalogue::find(effect.effect);
  return entry ? std::string(entry->info->separated_by) : "";
}

// What these data neither show nor rule out, and what to record.
void print_possible(Console& console, const Diagnosis& d) {
  for (const selection::PossibleEffect& one : d.possible) {
    std::string text = fmt::format("These data do not decide whether {} is missing", words(one.group));
    if (one.frequency) text += fmt::format(": chosen in {:.0f} of 100 subsamples", 100.0 * *one.frequency);
    text += fmt::format("; {}.", one.why_not);
    if (const std::string record = what_decides(d, one.group.front()); !record.empty())
      text += fmt::format(" To decide, record: {}.", record);
    console.line(wrapped(words_on(axis_of(d.unit), text)));
  }
}

// Candidates that are one with an effect of the model on these data.
void print_confounded_with_model(Console& console, const Diagnosis& d) {
  for (const Candidate& c : d.candidates) {
    const bool is_named = std::ranges::find(d.named, selection::NamedEffect{c.effect, c.order}) != d.named.end();
    const catalogue::Entry* entry = catalogue::find(c.effect);
    if (is_named || c.confounding_reasons.empty() || entry == nullptr) continue;
    console.line(wrapped(fmt::format("{} cannot be distinguished from {} of the model here. They are separated by {}.",
                                     effect_label(c.effect, c.order), c.confounding_reasons.front().effect,
                                     entry->info->separated_by)));
  }
}

// How large the named effects are.
void print_sizes(Console& console, const Diagnosis& d) {
  std::string sizes;
  for (const selection::NamedEffect& named : d.named)
    if (const Candidate* c = candidate_of(d, named); c && c->size)
      sizes += fmt::format("{}{}", sizes.empty() ? "" : "; ", size_in_words(*c, d.unit));
  if (!sizes.empty()) console.line(wrapped(words_on(axis_of(d.unit), sizes + ".")));
}

// What acts on one joint of an arm while others move is in no effect.
constexpr std::string_view kOtherAxes =
    "If other axes of the machine move in these records, their torque is a part of this error: map it, computed from "
    "the "
    "arm's model, as load_torque_nm, or move one joint alone.";
bool may_be_other_axes(const Diagnosis& d) {
  constexpr double kLargeShare = 0.05;
  const bool is_open = d.verdict == Verdict::nothing_significant || d.verdict == Verdict::unknown_structure;
  return is_open && d.base_rmse > kLargeShare * d.target_rms;
}

// A delay of a sample or more is a cause by itself, which is to be removed first. It is stated where it is significant.
bool is_delay_first(const Diagnosis& d, const data::Dataset* dataset) {
  if (!d.delay_s || d.delay_advice.empty() || !dataset) return false;
  double longest_s = 0.0;
  for (const data::Experiment& e : dataset->experiments) longest_s = std::max(longest_s, e.sample_s);
  return longest_s > 0.0 && std::abs(*d.delay_s) >= longest_s;
}

void print_diagnosis(Console& console, const Diagnosis& d, const std::string& add_command, const model::Drive* drive,
                     const data::Dataset* dataset) {
  const data::Axis axis = axis_of(d.unit);
  console.line(console.bold(wrapped(verdict_in_words(d), 0)));
  const std::string delay = d.delay_advice.empty() ? "" : wrapped(words_on(axis, d.delay_advice));
  const bool delay_first = is_delay_first(d, dataset);
  if (delay_first) console.line(delay);
  const std::string untried = d.untried_advice.empty() ? "" : wrapped(words_on(axis, d.untried_advice));
  const bool untried_first = d.named.empty() && d.verdict != Verdict::at_noise_floor;
  if (!untried.empty() && untried_first) console.line(untried);
  print_sizes(console, d);
  console.line(wrapped(evidence(d)));
  if (d.resampling && d.resampling->decides) print_resampling(console, *d.resampling);
  print_possible(console, d);
  if (!d.localised.empty())
    console.line(wrapped(words_on(axis, fmt::format("The error depends on {}.", shares(d.localised)))));
  if (!delay.empty() && !delay_first) console.line(delay);
  if (!untried.empty() && !untried_first) console.line(untried);
  if (may_be_other_axes(d)) console.line(wrapped(words_on(axis, std::string(kOtherAxes))));
  for (const selection::NamedEffect& named : d.named)
    if (const Candidate* c = candidate_of(d, named)) print_explanation(console, *c, d.unit, drive);
  if (d.law_in_range) console.line(wrapped(law_in_range_text(*d.law_in_range)));
  if (d.at_stated_setting && d.at_stated_setting->named != d.named)
    console.line(wrapped(stated_setting_text(*d.at_stated_setting)));
  if (d.unknown) print_unknown(console, d);
  if (!d.candidates.empty()) {
    console.line();
    console.line(candidate_table(d, drive));
    print_confounded_with_model(console, d);
  }
  for (const selection::Trend& t : d.parameter_trends)
    console.line(
        wrapped(fmt::format("{}.{} differs between experiments with {}: the model lacks something that depends on it.",
                            t.id, t.parameter, t.over)));
  if (!d.named.empty() && !d.remaining_structure.empty())
    console.line(wrapped(fmt::format("With {}, the error still depends on {}.",
                                     d.between_records ? "friction that is each record's own" : "that added",
                                     shares(d.remaining_structure))));
  print_disturbances(console, d.disturbances, dataset);
  print_next(console, d, add_command);
}

}  // namespace flexspline::output
