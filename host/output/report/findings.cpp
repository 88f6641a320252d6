#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/engine/estimation/standard_intervals.hpp"
#include "host/output/answers/diagnosis_sentences.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/output/report/parts.hpp"

namespace flexspline::report {
namespace {

using nlohmann::json;
using output::json_number;

// Up to here an error is called that of the noise (see comparison/README.md and the verdict at_noise_floor).
constexpr double kAtNoise = 1.3;

json parameter_json(const estimation::Estimate& e) {
  json parameter = output::json_parameter(e);
  output::add_by_experiment(parameter, e);
  parameter["identifiable"] = e.identifiable;
  return parameter;
}

// As it is set in print.
std::string with_unit(double value, std::string unit) {
  for (std::size_t at = unit.find('*'); at != std::string::npos; at = unit.find('*', at)) unit.replace(at, 1, "\u00b7");
  return output::with_unit(value, unit);
}

std::string in_words(std::string signal) {
  std::replace(signal.begin(), signal.end(), '_', ' ');
  return signal;
}

// The balance whose error is highest above its noise; without a noise, above its signal.
const comparison::SignalResult* worst_balance(const comparison::Comparison& comparison) {
  const comparison::SignalResult* worst = nullptr;
  const auto badness = [](const comparison::SignalResult& s) { return s.excess().value_or(s.nrmse); };
  for (const comparison::SignalResult& s : comparison.overall)
    if (s.signal.ends_with("_balance") && std::isfinite(badness(s)) && (!worst || badness(s) > badness(*worst)))
      worst = &s;
  return worst;
}

json headline(const std::string& signal, const std::string& unit, const std::string& on,
              const std::optional<double>& before, double error, const std::optional<double>& noise,
              const std::string& noise_from) {
  return {{"signal", signal},
          {"unit", unit},
          {"on", on},
          {"error_before", json_number(before)},
          {"error", json_number(error)},
          {"noise_floor", json_number(noise)},
          {"noise_floor_from", noise_from}};
}

std::string against_noise(double error, const std::optional<double>& noise) {
  if (!noise || !(*noise > 0.0)) return "the noise of the measurement is not known";
  return error <= kAtNoise * *noise
             ? fmt::format("that is the noise of the measurement ({:.2f} times it)", error / *noise)
             : fmt::format("that is {:.3g} times what noise alone would leave", error / *noise);
}

json of_addition(const selection::Addition& a, bool removed) {
  const bool held_out = a.before.rmse_holdout && a.after.rmse_holdout;
  const double before = held_out ? *a.before.rmse_holdout : a.before.rmse_fit;
  const double after = held_out ? *a.after.rmse_holdout : a.after.rmse_fit;
  const std::string on = held_out ? "on motions that the fit never saw" : "on the fitted data (none were held out)";
  const std::string verdict =
      fmt::format("With {} {}, the error of the {} {} {} from {} to {} ({:+.1f} %); {}.", a.effect,
                  removed ? "taken out" : "added", in_words(a.signal), on, after < before ? "decreases" : "goes",
                  with_unit(before, a.unit), with_unit(after, a.unit),
                  before > 0.0 ? 100.0 * (after / before - 1.0) : 0.0, against_noise(after, a.noise_floor));
  return {{"verdict", verdict},
          {"good", after < before},
          {"headline", headline(a.signal, a.unit, on, before, after, a.noise_floor, a.noise_floor_from)}};
}

json of_diagnosis(const selection::Diagnosis& d) {
  const std::string signal = d.balance ? std::string(selection::balance_signal(*d.balance)) : "";
  json result{{"verdict", output::verdict_in_words(d)},
              {"good", d.verdict == selection::Verdict::at_noise_floor},
              {"headline", nullptr}};
  if (signal.empty()) return result;
  result["headline"] =
      headline(signal, d.unit, "on the fitted data", std::nullopt, d.base_rmse, d.noise_floor, d.noise_floor_from);
  const std::string noise =
      d.noise_floor || !d.noise_of_some
          ? against_noise(d.base_rmse, d.noise_floor)
          : fmt::format("the noise is known in {} only, where the error is {:.3g} times that",
                        output::listed(d.noise_of_some->records), d.noise_of_some->rmse / d.noise_of_some->noise);
  std::string sentence =
      fmt::format(" The error of the {} is {}; {}.", in_words(signal), with_unit(d.base_rmse, d.unit), noise);
  if (d.verdict == selection::Verdict::missing_effect && !d.named.empty())
    for (const selection::Candidate& c : d.candidates) {
      if (c.effect != d.named.front().effect || c.order != d.named.front().order) continue;
      const std::string on = "in cross-validation";
      result["headline"] =
          headline(signal, d.unit, on, c.rmse_cv_before, c.rmse_cv_after, d.noise_floor, d.noise_floor_from);
      sentence += fmt::format(" With {}, the error {} decreases from {} to {}.", c.effect, on,
                              with_unit(c.rmse_cv_before, d.unit), with_unit(c.rmse_cv_after, d.unit));
    }
  result["verdict"] = result["verdict"].get<std::string>() + sentence;
  return result;
}

json of_comparison(const View& view) {
  const comparison::SignalResult* worst = worst_balance(view.comparison);
  if (!worst) return {{"verdict", "Nothing could be compared."}, {"good", false}, {"headline", nullptr}};
  const bool at_noise = worst->excess() && *worst->excess() <= kAtNoise;
  return {
      {"verdict",
       fmt::format("{} The {} is off by {}{}; {}.",
                   at_noise          ? "The model is as good as these data can show."
                   : worst->excess() ? "The model does not explain all of these data."
                                     : "How good the model can be is not known.",
                   in_words(worst->signal), with_unit(worst->rmse, worst->unit),
                   std::isfinite(worst->nrmse) ? fmt::format(" ({:.2g} % of its signal)", 100.0 * worst->nrmse) : "",
                   against_noise(worst->rmse, worst->noise_floor))},
      {"good", at_noise},
      {"headline", headline(worst->signal, worst->unit, "on all experiments together", std::nullopt, worst->rmse,
                            worst->noise_floor, worst->noise_floor_from)}};
}

}  // namespace

json verdict(const Subject& subject, const View& view) {
  if (subject.addition) {
    json result = of_addition(*subject.addition, subject.command == "remove");
    // A diagnosis came first: its words, then what became of it.
    if (!subject.rounds.empty())
      result["verdict"] = fmt::format("Before: {} Now: {}", output::verdict_in_words(subject.rounds.front()),
                                      result["verdict"].get<std::string>());
    return result;
  }
  if (subject.rounds.empty()) return of_comparison(view);
  json result = of_diagnosis(subject.rounds.front());
  if (subject.rounds.size() > 1)
    result["verdict"] = fmt::format(
        "{} After {} {} added: {}", result["verdict"].get<std::string>(), subject.rounds.size() - 1,
        subject.rounds.size() > 2 ? "effects were" : "effect was", output::verdict_in_words(subject.rounds.back()));
  return result;
}

json parameters(const Subject& subject, const View& view) {
  json list = json::array();
  if (!subject.estimates.empty()) {
    for (const estimation::Estimate& e : subject.estimates) list.push_back(parameter_json(e));
    return list;
  }
  // What the model file states of them.
  for (const model::Effect& effect : view.model.effects)
    for (const model::Parameter& p : effect.parameters) {
      if (!p.value) continue;
      estimation::Estimate e;
      e.id = effect.id;
      e.effect = effect.type;
      e.parameter = p.name;
      e.unit = p.unit;
      e.value = *p.value;
      e.std = p.std;
      if (p.std) {
        const estimation::Interval interval = estimation::interval_95(*p.value, *p.std);
        e.low = interval.low;
        e.high = interval.high;
      }
      e.spread_percent = p.spread_percent;
      // The file does not say of how many experiments the spread is, so a small one is no verdict.
      if (p.spread_percent && *p.spread_percent > estimation::kReliableSpreadPercent) e.reliable = false;
      list.push_back(parameter_json(e));
    }
  return list;
}

json addition(const Subject& subject, const View& view) {
  if (!subject.addition) return nullptr;
  const selection::Addition& a = *subject.addition;
  json bars = json::array();
  for (std::size_t i = 0; view.comparison_before && i < view.comparison.experiments.size(); ++i) {
    const comparison::SignalResult* after = view.result(i, a.signal);
    if (!after) continue;
    for (const comparison::SignalResult& before : view.comparison_before->experiments[i].signals)
      if (before.signal == a.signal)
        bars.push_back({{"experiment", view.comparison.experiments[i].name},
                        {"role", view.comparison.experiments[i].role == data::Role::holdout ? "holdout" : "fit"},
                        {"before", json_number(before.rmse)},
                        {"after", json_number(after->rmse)},
                        {"noise_floor", json_number(after->noise_floor)}});
  }
  const auto errors = [](const selection::Errors& e) -> json {
    return {{"rmse_fit", json_number(e.rmse_fit)}, {"rmse_holdout", json_number(e.rmse_holdout)}};
  };
  return {{"effect", a.effect},
          {"signal", a.signal},
          {"unit", a.unit},
          {"before", errors(a.before)},
          {"after", errors(a.after)},
          {"noise_floor", json_number(a.noise_floor)},
          {"noise_floor_from", a.noise_floor_from},
          {"experiments", std::move(bars)}};
}

}  // namespace flexspline::report
