#include "host/output/answers/diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "host/engine/selection/policy.hpp"
#include "host/output/answers/diagnosis_sentences.hpp"
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

std::string shares(const std::vector<selection::LocalisedResidual>& parts) {
  std::vector<std::string> texts;
  // Signals go together in any motion; the first few are enough.
  for (const selection::LocalisedResidual& part : std::span(parts).first(std::min<std::size_t>(3, parts.size())))
    texts.push_back(fmt::format("{} {:.1f} %", part.variable, part.share_percent));
  return listed(texts);
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

// What the columns are.
std::string about_table() {
  return fmt::format(
      "score: twice the logarithm of the likelihood ratio in cross-validation, less the penalty for "
      "parameters; "
      "a name needs {}. explains: the part of the squared error, weighted by the noise of each record, that it takes "
      "off there; errors are not weighted.",
      number(selection::kPolicy.named_score, 3));
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
      wrapped(fmt::format("It depends on {}{}: a curve over it reduces the squared error in cross-validation "
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
  console.line(wrapped(error_in_words(d)));
  for (const std::string& sentence : certainty_in_words(d)) console.line(wrapped(sentence));
  for (const std::string& sentence : possible_in_words(d)) console.line(wrapped(sentence));
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
    console.line(wrapped(about_table()));
    print_confounded_with_model(console, d);
  }
  for (const std::string& sentence : trends_in_words(d)) console.line(wrapped(sentence));
  if (!d.named.empty() && !d.remaining_structure.empty())
    console.line(wrapped(fmt::format("With {}, the error still depends on {}.",
                                     d.between_records ? "friction that is each record's own" : "that added",
                                     shares(d.remaining_structure))));
  print_disturbances(console, d.disturbances, dataset);
  print_next(console, d, add_command);
}

}  // namespace flexspline::output
