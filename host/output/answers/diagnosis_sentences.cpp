#include "host/output/answers/diagnosis_sentences.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/wald_test.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/explanation.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::output {
namespace {

using selection::Candidate;
using selection::Diagnosis;
using selection::Verdict;

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

// "2.4 %": root mean square of the error over that of the measured side of the balance.
std::string share_of_target(const Diagnosis& d) {
  return d.target_rms > 0.0 ? fmt::format("{:.2g} %", 100.0 * d.base_rmse / d.target_rms) : "a part";
}

// Of a structure that no single effect of the catalogue explains best.
std::string name_outside_catalogue(const std::string& name) {
  const bool are_several = name.find(" or ") != std::string::npos;
  return name + (are_several ? ", which these data cannot distinguish," : ", which is in no catalogue,");
}

std::string words(const std::vector<selection::NamedEffect>& group) {
  std::vector<std::string> names;
  for (const selection::NamedEffect& n : group) names.push_back(effect_in_words(n.effect, n.order));
  return listed(names, "or");
}

std::string resampling_in_words(const selection::Resampling& r) {
  std::vector<std::string> found;
  for (const selection::Resampling::FoundTerm& f : r.found) {
    found.push_back(
        fmt::format("{} is chosen in {:.0f} of 100 ({} % of the squared error above the noise, {:.0f} to {:.0f} %)",
                    f.group.empty() ? name_outside_catalogue(f.name) : words(f.group), 100.0 * f.frequency,
                    percent(clipped(f.share_percent)), clipped(f.share_low_percent), clipped(f.share_high_percent)));
  }
  return fmt::format(
      "Stability selection, {:.0f} halves of the data, low-pass filters from {:.3g} to {:.3g} Hz, with and without "
      "reversals: {}.",
      r.subsamples, r.lowest_hz, r.highest_hz, found.empty() ? "nothing is chosen often enough" : listed(found));
}

// The result on the experiments that are held out; empty without any. They decide whether an effect is named, so that
// their error is no proof of the gain.
std::string held_out_in_words(const selection::Resampling& r) {
  std::vector<std::string> better, worse;
  for (const selection::Resampling::FoundTerm& f : r.found) {
    if (!f.held_out_ratio || f.group.empty()) continue;
    const std::string name = effect_in_words(f.group.front().effect, f.group.front().order);
    (f.refused_by_holdout ? worse : better).push_back(fmt::format("{} {:.3f}", name, *f.held_out_ratio));
  }
  if (better.empty() && worse.empty()) return "";
  std::string text = "Error on the experiments that are held out, with the effect over without it: ";
  text += listed(better.empty() ? worse : better);
  if (!better.empty() && !worse.empty()) text += fmt::format("; {}", listed(worse));
  text += worse.empty() ? "."
                        : fmt::format(". It rises with {}, so {} not named.", listed(worse),
                                      worse.size() > 1 ? "these are" : "that is");
  return text +
         " As it was used to decide, it does not prove the gain: test that with `compare` on data of a later "
         "measurement.";
}

// What to record where an effect is neither shown nor ruled out.
std::string what_decides(const Diagnosis& d, const selection::NamedEffect& effect) {
  if (const Candidate* c = candidate_of(d, effect); c && !selection::doubt_about_presliding(*c).empty())
    return "slower reversals, or the same at a higher sample rate or with a finer encoder";
  const catalogue::Entry* entry = catalogue::find(effect.effect);
  return entry ? std::string(entry->info->separated_by) : "";
}

}  // namespace

std::string effect_label(const std::string& effect, const std::optional<double>& order) {
  return order ? fmt::format("{}:{:g}", effect, *order) : effect;
}

std::string effect_in_words(const std::string& effect, const std::optional<double>& order) {
  return order ? fmt::format("{} ({:g} per turn)", effect, *order) : effect;
}

const Candidate* candidate_of(const Diagnosis& d, const selection::NamedEffect& named) {
  for (const Candidate& c : d.candidates)
    if (selection::NamedEffect{c.effect, c.order} == named) return &c;
  return nullptr;
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

std::string error_in_words(const Diagnosis& d) {
  std::string text;
  if (d.balance) text += fmt::format("{} balance: ", catalogue::balance_name(*d.balance));
  text += fmt::format("error {}, {} in cross-validation", with_unit(d.base_rmse, d.unit),
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

std::vector<std::string> certainty_in_words(const Diagnosis& d) {
  std::vector<std::string> sentences;
  if (d.resampling && d.resampling->decides) {
    sentences.push_back(resampling_in_words(*d.resampling));
    if (std::string held_out = held_out_in_words(*d.resampling); !held_out.empty())
      sentences.push_back(std::move(held_out));
    return sentences;
  }
  std::vector<std::string> scores;
  for (const selection::NamedEffect& named : d.named)
    if (const Candidate* c = candidate_of(d, named); c && c->score >= selection::kPolicy.named_score)
      scores.push_back(fmt::format("{} for {}", number(c->score), effect_in_words(c->effect, c->order)));
  if (!scores.empty())
    sentences.push_back(
        fmt::format("Score {}; a name needs {}, which 1 of 1000 simulated drives with nothing missing exceeds.",
                    listed(scores), number(selection::kPolicy.named_score, 3)));
  return sentences;
}

std::vector<std::string> trends_in_words(const Diagnosis& d) {
  std::vector<std::pair<std::string, std::vector<std::string>>> over;  // what each parameter differs with
  for (const selection::Trend& t : d.parameter_trends) {
    const std::string parameter = fmt::format("{}.{}", t.id, t.parameter);
    const auto known = std::ranges::find(over, parameter, &decltype(over)::value_type::first);
    (known == over.end() ? over.emplace_back(parameter, std::vector<std::string>{}) : *known).second.push_back(t.over);
  }
  std::vector<std::string> sentences;
  for (const auto& [parameter, variables] : over)
    sentences.push_back(
        d.named.empty() ? fmt::format("{} differs between experiments with {}: the model lacks something that depends "
                                      "on {}.",
                                      parameter, listed(variables), variables.size() > 1 ? "one of these" : "it")
                        : fmt::format("Without what is named, {} differs between experiments with {}; see whether it "
                                      "still does with it.",
                                      parameter, listed(variables)));
  return sentences;
}

std::vector<std::string> possible_in_words(const Diagnosis& d) {
  std::vector<std::string> sentences;
  for (const selection::PossibleEffect& one : d.possible) {
    std::string text = fmt::format("These data do not decide whether {} is missing", words(one.group));
    if (one.frequency) text += fmt::format(": chosen in {:.0f} of 100 subsamples", 100.0 * *one.frequency);
    text += fmt::format("; {}.", one.why_not);
    if (const std::string record = what_decides(d, one.group.front()); !record.empty())
      text += fmt::format(" To decide, record: {}.", record);
    sentences.push_back(words_on(axis_of(d.unit), text));
  }
  return sentences;
}

}  // namespace flexspline::output
