#include "host/output/answers/explanation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/output/answers/diagnosis_sentences.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::output {
namespace {

using nlohmann::json;
using selection::Candidate;
using selection::Evidence;

constexpr int kBarWidth = 24;

std::string variable_in_words(std::string name, const std::string& unit) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return words_on(axis_of(unit), name);
}

// A bar from the middle: to the right what is positive.
std::string bar(double value, double largest) {
  const int half = kBarWidth / 2;
  const int length = largest > 0.0 ? static_cast<int>(std::lround(std::abs(value) / largest * half)) : 0;
  std::string text(kBarWidth + 1, ' ');
  text[half] = '|';
  for (int i = 1; i <= length; ++i) text[static_cast<std::size_t>(value < 0.0 ? half - i : half + i)] = '#';
  return text;
}

void print_map(Console& console, const Evidence& map, const std::string& unit) {
  console.line(wrapped(
      fmt::format("Where it shows here: over {}. What the model lacks{}, and what the effect makes of it:",
                  variable_in_words(map.variable, unit), map.resisting ? " (positive: it resists the motion)" : "")));
  Table table({fmt::format("{}{}", variable_in_words(map.variable, unit), map.unit.empty() ? "" : ", " + map.unit),
               "lacks, " + unit, "effect, " + unit, ""},
              "rrrl");
  double largest = 0.0;
  for (const Evidence::Bin& bin : map.bins) largest = std::max(largest, std::abs(bin.lacking));
  for (const Evidence::Bin& bin : map.bins)
    table.row({fmt::format("{} to {}", number(bin.low, 3), number(bin.high, 3)), number(bin.lacking, 3),
               number(bin.effect, 3), bar(bin.lacking, largest)});
  console.line(table.text(4));
}

void print_confounding(Console& console, const Candidate& c, std::string_view separated_by, const std::string& unit) {
  for (const selection::ConfoundingReason& reason : c.confounding_reasons)
    console.line(wrapped(fmt::format(
        "Cannot be distinguished from {} here: only {:.2g} % of its {} in these data is orthogonal to it{}.",
        reason.effect, reason.own_percent, words_on(axis_of(unit), "torque"),
        reason.variable.empty() ? "" : fmt::format("; both depend on {}", variable_in_words(reason.variable, unit)))));
  if (!c.cannot_distinguish.empty() && !separated_by.empty())
    console.line(wrapped(fmt::format("To separate them, record {}; flexspline plan --separate designs it.",
                                     words_on(axis_of(unit), separated_by))));
}

// What on this drive makes a ripple of this order.
void print_order_causes(Console& console, const Candidate& c) {
  if (!c.order_causes.empty())
    console.line(wrapped(fmt::format("On this drive {:g} per motor turn is the order of:", *c.order)));
  for (const catalogue::OrderCause& one : c.order_causes) {
    console.line(wrapped(fmt::format("- {} ({}).", one.cause, one.from), 2, 2));
    console.line(wrapped(fmt::format("Check: {}", one.check), 4, 2));
    console.line(wrapped(fmt::format("Cure: {}", one.cure), 4, 2));
  }
  if (!c.order_hint.empty()) console.line(wrapped(c.order_hint));
}

// "0.0121 N*m (RMS)"
std::string rms_in_words(const selection::EffectSize& size, const std::string& unit) {
  return fmt::format("{} {} (RMS)", number(size.rms), unit);
}

// "; 0.16 % of the rated torque (0.48 N*m at the motor)"; empty where that is not stated.
std::string share_of_rated(const Candidate& c, const std::string& unit, std::string_view joint) {
  const std::optional<double> percent = c.size->percent_of_rated;
  if (!percent) return "";
  const std::string share = fmt::format("{}{} % of the rated torque", joint, number(*percent, 2));
  if (!(*percent > 0.0)) return share;
  return fmt::format("{} ({} {}{})", share, number(c.size->rms / (0.01 * *percent), 3), unit,
                     c.balance == estimation::Balance::motor ? " at the motor" : "");
}

// On which side of the gear the values of an effect are, whichever balance shows it.
bool is_of_motor(const Candidate& c) {
  const catalogue::Entry* entry = catalogue::find(c.effect);
  return (entry ? entry->info->balance : c.balance) == estimation::Balance::motor;
}

// The rated torque on that side; nothing where it is not stated.
std::optional<double> rated_torque(const Candidate& c, const model::Drive* drive) {
  if (!drive || !drive->rated_torque_nm.value || !(*drive->rated_torque_nm.value > 0.0)) return std::nullopt;
  return *drive->rated_torque_nm.value / (is_of_motor(c) ? drive->gear_ratio.value.value_or(1.0) : 1.0);
}

// Whether no such drive has an effect of the smallest detectable size: a torque above the rated one, at the rated
// velocity where it is proportional to that; else a value above its bound, or far above the usual one.
bool is_beyond_drive(const Candidate& c, const model::Drive* drive) {
  constexpr double kFarAboveUsual = 100.0;
  const estimation::Estimate& size = c.minimum_detectable->size;
  const double value = std::abs(size.value);
  const std::optional<double> rated = rated_torque(c, drive);
  if (rated && (size.unit == "N*m" || size.unit == "N")) return value > *rated;
  if (rated && size.unit == "N*m*s/rad" && is_of_motor(c) && drive->rated_velocity_rad_s.value)
    return value * *drive->rated_velocity_rad_s.value > *rated;
  const catalogue::Entry* entry = catalogue::find(c.effect);
  if (entry == nullptr) return false;
  // The size of a wave has the bounds of its parts.
  const std::string_view name = size.parameter == "amplitude" ? "cosine" : std::string_view(size.parameter);
  const auto info = std::ranges::find(entry->parameters, name, &effects::ParameterInfo::name);
  if (info == entry->parameters.end()) return false;
  return value > info->high || (info->usual != 0.0 && value > kFarAboveUsual * std::abs(info->usual));
}

}  // namespace

std::string size_in_words(const Candidate& c, const std::string& unit) {
  constexpr double kSmallPercent = 0.5;
  if (!c.size) return "";
  return fmt::format("{}: {}{}{}", effect_in_words(c.effect, c.order), rms_in_words(*c.size, unit),
                     share_of_rated(c, unit, ", "),
                     c.size->percent_of_rated && *c.size->percent_of_rated < kSmallPercent ? ", small" : "");
}

void print_explanation(Console& console, const Candidate& c, const std::string& unit, const model::Drive* drive) {
  const catalogue::Entry* entry = catalogue::find(c.effect);
  if (entry == nullptr) return;
  const effects::Description& info = *entry->info;
  console.line();
  console.line(console.bold(effect_in_words(c.effect, c.order)));
  const auto print = [&](std::string_view what, std::string_view text) {
    if (!text.empty()) console.line(wrapped(fmt::format("{}{}", what, words_on(axis_of(unit), text))));
  };
  print("", info.explanation);
  for (const estimation::Estimate& e : c.parameters)
    console.line(
        fmt::format("  {} = {}{}", e.parameter, with_unit(e.value, e.unit),
                    e.low && e.high ? fmt::format("   (95 %: {} to {})", number(*e.low), number(*e.high)) : ""));
  if (const std::string reference = drive ? reference_text(c.effect, *drive) : ""; !reference.empty())
    console.line(fmt::format("  {}", reference));
  if (c.size)
    console.line(wrapped(words_on(
        axis_of(unit),
        fmt::format("The part of its torque that the other effects of the model cannot replace: {}, {} at most{}.",
                    rms_in_words(*c.size, unit), number(c.size->peak), share_of_rated(c, unit, "; ")))));
  print("", c.note);
  if (c.evidence && !c.evidence->bins.empty()) print_map(console, *c.evidence, unit);
  print("What it does: ", info.consequence);
  print_order_causes(console, c);
  print("Usual causes: ", info.causes);
  print("Check on the machine: ", info.check);
  print_confounding(console, c, info.separated_by, unit);
}

std::string detectable_in_words(const Candidate& c, const model::Drive* drive) {
  if (!c.minimum_detectable) return "";
  if (!c.minimum_detectable->at_most && is_beyond_drive(c, drive)) return "not visible in these data";
  const estimation::Estimate& e = c.minimum_detectable->size;
  return fmt::format("{}{} {}", c.minimum_detectable->at_most ? "below " : "", e.parameter,
                     with_unit(std::stod(number(e.value, 2)), e.unit));
}

json detectable_json(const Candidate& c) {
  if (!c.minimum_detectable) return nullptr;
  json answer = json_parameter(c.minimum_detectable->size);
  answer["at_most"] = c.minimum_detectable->at_most;
  answer["at"] = json::array();
  for (const estimation::Estimate& e : c.minimum_detectable->at) answer["at"].push_back(json_parameter(e));
  return answer;
}

json confounding_reasons_json(const Candidate& c) {
  json list = json::array();
  for (const selection::ConfoundingReason& r : c.confounding_reasons)
    list.push_back({{"effect", r.effect},
                    {"own_percent", json_number(r.own_percent)},
                    {"variable", r.variable.empty() ? json(nullptr) : json(r.variable)}});
  return list;
}

json order_causes_json(const Candidate& c) {
  if (!c.order) return nullptr;
  json list = json::array();
  for (const catalogue::OrderCause& one : c.order_causes)
    list.push_back({{"from", one.from},
                    {"cause", one.cause},
                    {"check", one.check},
                    {"cure", one.cure},
                    {"reference", one.reference}});
  return list;
}

json size_json(const Candidate& c, const std::string& unit) {
  if (!c.size) return nullptr;
  return {{"rms", json_number(c.size->rms)},
          {"peak", json_number(c.size->peak)},
          {"unit", unit},
          {"percent_of_rated", c.size->percent_of_rated ? json_number(*c.size->percent_of_rated) : json(nullptr)}};
}

json evidence_json(const Candidate& c, const std::string& unit) {
  if (!c.evidence) return nullptr;
  const Evidence& map = *c.evidence;
  json bins = json::array();
  for (const Evidence::Bin& bin : map.bins)
    bins.push_back({{"low", json_number(bin.low)},
                    {"high", json_number(bin.high)},
                    {"lacking", json_number(bin.lacking)},
                    {"effect", json_number(bin.effect)}});
  return {{"variable", map.variable},
          {"variable_unit", map.unit},
          {"unit", unit},
          {"resisting", map.resisting},
          {"bins", std::move(bins)}};
}

}  // namespace flexspline::output
