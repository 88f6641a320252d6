#include "host/output/answers/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "host/output/answers/drive_words.hpp"

namespace flexspline::output {
namespace {

using comparison::BaselineResult;
using comparison::Comparison;
using comparison::ExperimentResult;
using comparison::Region;
using comparison::SignalResult;

constexpr std::size_t kRegionsInWords = 3;

// Times the noise floor, or where there is none, share of the signal. A free run sums errors up and does not count.
double badness(const ExperimentResult& e) {
  double worst = 0.0;
  for (const SignalResult& s : e.signals)
    if (s.signal.ends_with("_balance")) {
      const double bad = s.excess().value_or(s.nrmse);
      if (std::isfinite(bad)) worst = std::max(worst, bad);
    }
  return worst;
}

std::string cell(double x, const char* suffix = "") {
  return std::isfinite(x) ? fmt::format("{:.4g}{}", x, suffix) : std::string("-");
}

std::string label(const ExperimentResult& e) {
  return e.role == data::Role::holdout ? e.name + " (hold-out)" : e.name;
}

void add_line(std::string& text, std::size_t width, std::string_view first, const SignalResult& s) {
  const auto excess = s.excess();
  fmt::format_to(std::back_inserter(text), "{:<{}} {:<20} {:>10} {:<6} {:>8} {:>10} {:>8} {:>10} {:>8}\n", first, width,
                 s.signal + (s.collapsed ? "*" : ""), cell(s.rmse), s.unit, cell(100.0 * s.nrmse, " %"),
                 s.noise_floor ? cell(*s.noise_floor) : "-", excess ? cell(*excess) : "-", cell(s.max_abs),
                 cell(s.h_infinity.value));
}

std::string words(const Region& r, const SignalResult& overall, data::Axis axis) {
  std::string signal = words_on(axis, r.signal), variable = words_on(axis, r.variable);
  std::replace(signal.begin(), signal.end(), '_', ' ');
  std::replace(variable.begin(), variable.end(), '_', ' ');
  const std::string unit = r.variable_unit.empty() ? "" : " " + r.variable_unit;
  const std::string size = std::isfinite(r.excess) ? fmt::format("{:.1f} times the noise", r.excess)
                                                   : fmt::format("{:.1f} times the error of all samples",
                                                                 overall.rmse > 0.0 ? r.rmse / overall.rmse : 0.0);
  const char* side = r.bias > 0.0 ? "too little" : "too much";
  return fmt::format(
      "The {} at {} from {:.4g} to {:.4g}{}: error {:.3g} {}, {}; on average the model gives {:.3g} {} {}.\n", signal,
      variable, r.low, r.high, unit, r.rmse, r.unit, size, std::abs(r.bias), r.unit, side);
}

// One line for each black box, with the physical model's error on the same samples.
std::string baseline_table(const std::vector<BaselineResult>& results) {
  std::string text =
      "\nBaseline comparison: black boxes fitted to the same signals (free run; the model on the same samples):\n";
  const auto line = [&text](std::string_view box, std::string_view signal, std::string_view unit,
                            const auto&... cells) {
    fmt::format_to(std::back_inserter(text), "{:<14} {:<21} {:<6}", box, signal, unit);
    ((fmt::format_to(std::back_inserter(text), " {:>10}", cells)), ...);
    text += '\n';
  };
  line("black box", "signal", "unit", "parameters", "rmse", "model", "held out", "model", "one step", "rmse/std");
  bool unstable = false;
  for (const BaselineResult& b : results) {
    line(b.black_box + (b.stable ? "" : "!"), b.load.empty() ? b.signal : fmt::format("{} {}", b.signal, b.load),
         b.unit, b.parameters, cell(b.rmse), cell(b.model_rmse), cell(b.rmse_holdout), cell(b.model_rmse_holdout),
         cell(b.rmse_one_step), cell(100.0 * b.nrmse, " %"));
    unstable = unstable || !b.stable;
  }
  if (unstable) text += "! not stable: its free run grows without bound\n";
  return text;
}

}  // namespace

std::string comparison_table(const Comparison& comparison) {
  std::size_t width = std::string_view("all together").size();
  for (const ExperimentResult& e : comparison.experiments) width = std::max(width, label(e).size());
  std::string text = fmt::format("{:<{}} {:<20} {:>10} {:<6} {:>8} {:>10} {:>8} {:>10} {:>8}\n", "experiment", width,
                                 "signal", "rmse", "unit", "rmse/std", "noise", "ratio", "max |e|", "H-inf");
  bool collapsed = false;
  for (const ExperimentResult& e : comparison.experiments) {
    bool first = true;
    for (const SignalResult& s : e.signals) {
      add_line(text, width, first ? label(e) : "", s);
      collapsed = collapsed || s.collapsed;
      first = false;
    }
  }
  bool first = true;
  for (const SignalResult& s : comparison.overall) {
    add_line(text, width, first ? "all together" : "", s);
    first = false;
  }
  const data::Axis axis = axis_of(comparison.overall.empty() ? "" : comparison.overall.front().unit);
  if (collapsed) text += words_on(axis, "* motor and load as one balance: no torque was measured\n");

  const auto worst = std::max_element(comparison.experiments.begin(), comparison.experiments.end(),
                                      [](const auto& a, const auto& b) { return badness(a) < badness(b); });
  if (comparison.experiments.size() > 1)
    text += fmt::format("Largest error of a balance, over its noise or else its signal: {}\n", label(*worst));

  const auto size = [&](const Region& r) {
    const SignalResult* overall = comparison.find_overall(r.signal);
    if (std::isfinite(r.excess)) return r.excess;
    return overall && overall->rmse > 0.0 ? r.rmse / overall->rmse : 0.0;
  };
  std::vector<const Region*> regions;
  for (const Region& r : comparison.regions) regions.push_back(&r);
  std::stable_sort(regions.begin(), regions.end(), [&](auto* a, auto* b) { return size(*a) > size(*b); });
  // One sentence for each variable; its neighbouring bins would repeat it.
  std::vector<const Region*> printed;
  for (const Region* r : regions) {
    if (printed.size() == kRegionsInWords) break;
    if (std::any_of(printed.begin(), printed.end(),
                    [&](const Region* s) { return s->signal == r->signal && s->variable == r->variable; }))
      continue;
    printed.push_back(r);
  }
  if (!printed.empty()) text += "\nWhere the error is largest:\n";
  for (const Region* r : printed)
    if (const SignalResult* overall = comparison.find_overall(r->signal)) text += "  " + words(*r, *overall, axis);
  if (!comparison.baselines.empty()) text += baseline_table(comparison.baselines);
  return text;
}

}  // namespace flexspline::output
