#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/engine/sensitivity/sensitivity.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/sensitivity.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

using output::number;
using sensitivity::Sensitivity;
using sensitivity::SignalError;
using sensitivity::Variant;

struct SensitivityOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  bool refit = false;
  std::vector<std::string> scale;  // EFFECT.PARAMETER=FACTOR
  std::string json;
};

constexpr int kShareDigits = 3;
constexpr std::size_t kSignalsOfOne = 3;
constexpr std::size_t kSentences = 3;
// Less growth, in shares of the signal, is not worth a line.
constexpr double kLeastShownGrowth = 0.005;

std::string name_of(const SignalError& s) {
  std::string name = s.signal;
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}
std::string signal_name(const SignalError& s) {
  return s.load.empty() ? name_of(s) : name_of(s) + ", " + s.load;
}

std::string error_text(const SignalError& s) {
  return std::isnan(s.rmse) ? "diverges" : number(s.rmse, kShareDigits);
}
// "+12 %", "-0.4 deg", "0.0 deg"
std::string change_text(double change, const char* unit) {
  if (!std::isfinite(change)) return "-";
  const double rounded = std::abs(change) < 10.0 ? std::round(10.0 * change) / 10.0 : std::round(change);
  const char* sign = rounded > 0.0 ? "+" : rounded < 0.0 ? "-" : "";
  return fmt::format("{}{:.{}f} {}", sign, std::abs(rounded), std::abs(rounded) < 10.0 ? 1 : 0, unit);
}
std::string amplitude_text(const SignalError& s) {
  return change_text(100.0 * (s.response.amplitude_ratio - 1.0), "%");
}
std::string phase_text(const SignalError& s) {
  return change_text(s.response.phase_deg, "deg");
}

// Those that show most, except free positions: they are velocities once more, with their drift.
std::vector<const SignalError*> most_changed(const Variant& variant) {
  std::vector<const SignalError*> signals;
  for (const SignalError& s : variant.overall)
    if (!s.drifts() && std::abs(s.growth) >= kLeastShownGrowth) signals.push_back(&s);
  std::stable_sort(signals.begin(), signals.end(), [](auto* a, auto* b) { return a->growth > b->growth; });
  if (signals.size() > kSignalsOfOne) signals.resize(kSignalsOfOne);
  return signals;
}

std::string label_of(const Variant& variant) {
  std::string label = variant.label();
  for (const std::string& also : variant.also_left_out) label += " and " + also;
  return label;
}

std::string table_of(const Sensitivity& answer, std::vector<std::string>& nothing, std::vector<std::string>& notes) {
  output::Table table({"model", "signal", "error", "unit", "amplitude", "phase", "most in"}, "llllrrl");
  bool first = true;
  for (const SignalError& s : answer.full.overall) {
    if (s.drifts()) continue;
    table.row({first ? answer.full.label() : "", signal_name(s), error_text(s), s.unit, amplitude_text(s),
               phase_text(s), ""});
    first = false;
  }
  for (const Variant& variant : answer.variants) {
    if (!variant.note.empty()) notes.push_back(fmt::format("{}: {}", label_of(variant), variant.note));
    const std::vector<const SignalError*> signals = most_changed(variant);
    if (signals.empty() && variant.note.empty()) nothing.push_back(label_of(variant));
    for (const SignalError* s : signals) {
      const SignalError* full = answer.full.find(s->signal, s->load);
      table.row({s == signals.front() ? label_of(variant) : "", signal_name(*s),
                 fmt::format("{} -> {}", error_text(*full), error_text(*s)), s->unit, amplitude_text(*s),
                 phase_text(*s), s->worst_experiment});
    }
  }
  return table.text(0);
}

// "leaving out coulomb_friction: free motor velocity error 3.1 -> 14.2 rad/s, amplitude +12 %, phase -4.0 deg".
// What moves otherwise is easier to see than what a balance lacks.
std::string sentence(const Sensitivity& answer, const Variant& variant) {
  const std::vector<const SignalError*> signals = most_changed(variant);
  if (signals.empty()) return {};
  const auto moving = std::find_if(signals.begin(), signals.end(), [](auto* s) { return !s->is_balance(); });
  const SignalError& s = moving == signals.end() ? *signals.front() : **moving;
  std::string text = fmt::format(
      "{}: {}{}{} error {} -> {} {}",
      variant.change->leaves_out() ? "leaving out " + variant.change->effect : "with " + variant.label(), s.load,
      s.load.empty() ? "" : " ", name_of(s), error_text(*answer.full.find(s.signal, s.load)), error_text(s), s.unit);
  if (std::isfinite(s.response.amplitude_ratio))
    text += fmt::format(", amplitude {}, phase {}", amplitude_text(s), phase_text(s));
  return text;
}

void print(const Sensitivity& answer, Console& console) {
  console.line(console.bold(answer.refit ? "What the model depends on, the other parameters re-estimated each time"
                                         : "What the model depends on, the other parameters as they are"));
  std::vector<std::string> printed;
  for (const Variant& variant : answer.variants) {
    if (printed.size() == kSentences) break;
    if (std::find(printed.begin(), printed.end(), variant.change->effect) != printed.end()) continue;
    const std::string text = sentence(answer, variant);
    if (text.empty()) continue;
    console.line("  " + text);
    printed.push_back(variant.change->effect);
  }
  console.line();
  std::vector<std::string> nothing, notes;
  console.line(table_of(answer, nothing, notes));
  console.line();
  if (!nothing.empty())
    console.line(output::wrapped(
        fmt::format("No error grows by {:g} % of its signal: {}. They need not be modelled, or these motions do not "
                    "show them.",
                    100.0 * kLeastShownGrowth, output::listed(nothing)),
        0));
  for (const std::string& note : notes) console.line(output::wrapped(note, 0));
  console.line(
      output::wrapped("Amplitude and phase: simulated over measured at the frequency of the motion; a positive "
                      "phase leads. Most in: the experiment in which the error grows most.",
                      0));
}

int run(const SensitivityOptions& options, Console& console) {
  sensitivity::Options wanted{.pipeline = options.pipeline.options(), .refit = options.refit};
  try {
    for (const std::string& text : options.scale) wanted.more.push_back(sensitivity::parse_scaling(text));
  } catch (const std::invalid_argument& wrong) {
    throw UsageError(fmt::format("--scale {}", wrong.what()));
  }
  const model::ModelFile file = load_searched_model(options.model);
  const data::Dataset dataset = load(options.data, console);
  console.progress("evaluating the full model");
  wanted.progress = [&console](std::size_t done, std::size_t all) {
    console.progress(fmt::format("{} of {} changed models evaluated", done, all));
  };
  const Sensitivity answer = sensitivity::analyse(dataset, file.model, wanted);
  for (const std::string& warning : answer.warnings) console.warn(warning);
  print(answer, console);
  output::save_json(options.json, output::sensitivity_json(answer));
  return kDone;
}

void declare(Parser& parser, SensitivityOptions& options) {
  take_data(parser, options.data);
  take_model(parser, options.model);
  parser.flag("--refit", options.refit,
              "re-estimate the remaining parameters each time: the error that the other effects cannot compensate");
  parser.option("--scale", options.scale, "scale a parameter, too; may be repeated")
      .value("EFFECT.PARAMETER=FACTOR")
      .one_value_each_time();
  take_holdout(parser, options.data);
  take_pipeline(parser, options.pipeline);
}

}  // namespace

Command sensitivity_command() {
  return command<SensitivityOptions>(
      {"sensitivity",
       "what the model depends on: each effect left out or scaled in turn",
       "Leaves each effect of the model out in turn, and scales the stiffness to a tenth and to ten times (and with "
       "--scale any parameter), everything else as it is. Each of these models is evaluated as compare does: the "
       "torque balances, and the free run with its amplitude and phase at the frequency of the motion. The largest "
       "growth of an error comes first. An effect that hardly changes any error need not be modelled, or these "
       "motions do not show it. With --refit the other parameters are re-estimated first: the error that they cannot "
       "compensate is what the effect is needed for.",
       {kMakeData, kIdentify,
        "flexspline sensitivity --model fitted.toml demo-out --scale viscous_friction.coefficient=1.5"}},
      declare, run);
}

}  // namespace flexspline::cli
