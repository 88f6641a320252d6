#include "host/output/answers/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::output {
namespace {

using estimation::ByExperiment;
using estimation::Estimate;
using estimation::ExperimentValue;
using nlohmann::json;

constexpr std::size_t kExperimentsAbreast = 5;
constexpr std::size_t kNameWidth = 13;
constexpr int kDigits = 5;  // an interval of 0.1 % is still one

std::string label(const Estimate& e) {
  return fmt::format("{}.{}", e.id, e.parameter);
}

// As heads of columns. Where several begin alike, their ends are kept: "repo..ction-1", "repo..ction-2".
std::vector<std::string> heads_of(const std::vector<std::string>& names) {
  constexpr std::size_t kBeginning = 4;
  const auto head = [](const std::string& name) {
    return name.size() <= kNameWidth ? name : fmt::format("{}..", text::beginning_of(name, kNameWidth - 2));
  };
  std::vector<std::string> heads;
  for (const std::string& name : names) {
    heads.push_back(head(name));
    const bool several = std::count_if(names.begin(), names.end(),
                                       [&](const std::string& other) { return head(other) == head(name); }) > 1;
    if (several && name.size() > kNameWidth)
      heads.back() = fmt::format("{}..{}", text::beginning_of(name, kBeginning),
                                 text::ending_of(name, kNameWidth - 2 - kBeginning));
  }
  return heads;
}

std::vector<std::string> experiment_names(const estimation::Identification& found) {
  std::vector<std::string> names;
  for (const Estimate& e : found.estimates)
    for (const ExperimentValue& v : e.per_experiment)
      if (std::find(names.begin(), names.end(), v.name) == names.end()) names.push_back(v.name);
  return names;
}

std::optional<double> value_in(const ByExperiment& e, const std::string& experiment) {
  for (const ExperimentValue& v : e.per_experiment)
    if (v.name == experiment) return v.value;
  return std::nullopt;
}

// What stands below each other: the parameters, then what is derived of two of them.
std::vector<std::pair<std::string, const ByExperiment*>> values_to_list(const estimation::Identification& found) {
  std::vector<std::pair<std::string, const ByExperiment*>> lines;
  for (const Estimate& e : found.estimates)
    if (!e.per_experiment.empty()) lines.emplace_back(label(e), &e);
  for (const estimation::Derived& d : found.derived)
    if (!d.per_experiment.empty()) lines.emplace_back(d.name, &d);
  return lines;
}

std::string spread_cell(const ByExperiment& e) {
  std::string cell = "-";
  if (e.spread_percent)
    cell = fmt::format("{:.1f} %{}", *e.spread_percent,
                       *e.spread_percent > estimation::kReliableSpreadPercent ? " !" : "");
  if (e.left_out() > 0) cell += fmt::format(" ({} of {})", e.counted(), e.per_experiment.size());
  return cell;
}

// Which experiments a spread leaves out, by reason: "50-7, 50-8: its own standard error is above 20 %".
std::string left_out_text(const ByExperiment& e) {
  constexpr std::size_t kNamed = 3;
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const ExperimentValue& v : e.per_experiment)
    if (!v.value) by_reason[v.left_out].push_back(v.name);
  std::string text;
  for (const auto& [reason, names] : by_reason) {
    std::string list;
    for (std::size_t k = 0; k < std::min(kNamed, names.size()); ++k) list += (k == 0 ? "" : ", ") + names[k];
    if (names.size() > kNamed) list += fmt::format(" and {} more", names.size() - kNamed);
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", list, reason);
  }
  return fmt::format("{} of {} experiments count; left out: {}", e.counted(), e.per_experiment.size(), text);
}

std::string remarks(const std::vector<std::pair<std::string, const ByExperiment*>>& lines) {
  std::string text;
  bool differs = false;
  std::vector<std::string> few;
  for (const auto& [name, e] : lines) {
    differs = differs || e->spread_percent.value_or(0.0) > estimation::kReliableSpreadPercent;
    if (e->per_experiment.size() >= estimation::kFewestForReliable && e->counted() < estimation::kFewestForReliable)
      few.push_back(name);
  }
  if (differs)
    text +=
        "\n  ! differs by more than 30 % from experiment to experiment: not reliable, or an effect is missing "
        "(flexspline diagnose)";
  // Parameters of one balance often leave out the same experiments.
  std::vector<std::pair<std::string, std::string>> by_text;
  for (const auto& [name, e] : lines) {
    if (e->left_out() == 0) continue;
    const std::string why = left_out_text(*e);
    const auto same = std::find_if(by_text.begin(), by_text.end(), [&](const auto& one) { return one.first == why; });
    if (same == by_text.end())
      by_text.emplace_back(why, name);
    else
      same->second += ", " + name;
  }
  for (const auto& [why, names] : by_text) text += "\n" + wrapped(fmt::format("  {}: {}", names, why));
  if (!few.empty())
    text += "\n" + wrapped(fmt::format("  Fewer than three experiments count for {}, which does not show whether {} "
                                       "reliable.",
                                       listed(few), few.size() > 1 ? "they are" : "it is"));
  return text;
}

std::string by_experiment(const estimation::Identification& found) {
  const std::vector<std::string> names = experiment_names(found);
  if (names.empty()) return {};
  const std::vector<std::string> heads = heads_of(names);
  const auto lines = values_to_list(found);
  std::string text;
  // Side by side as far as a terminal is wide; average and spread are next to the last ones.
  for (std::size_t first = 0; first < names.size(); first += kExperimentsAbreast) {
    const std::size_t last = std::min(names.size(), first + kExperimentsAbreast);
    const bool ends = last == names.size();
    std::vector<std::string> head = {"by experiment"};
    for (std::size_t k = first; k < last; ++k) head.push_back(heads[k]);
    if (ends) head.insert(head.end(), {"average", "std/avg"});
    Table table(head, "lr");
    for (const auto& [name, e] : lines) {
      std::vector<std::string> cells = {name};
      for (std::size_t k = first; k < last; ++k) cells.push_back(number(value_in(*e, names[k])));
      if (ends) {
        cells.push_back(number(e->average));
        cells.push_back(spread_cell(*e));
      }
      table.row(cells);
    }
    text += (text.empty() ? "" : "\n\n") + table.text();
  }
  text += remarks(lines);
  return text;
}

std::string pooled(const estimation::Identification& found) {
  Table table({"pooled", "value", "95 % interval", "", "unit", "excited", ""}, "lrrrlrl");
  for (const Estimate& e : found.estimates)
    table.row({label(e), number(e.value, kDigits), number(e.low, kDigits), number(e.high, kDigits), e.unit,
               e.excitation ? fmt::format("{:.3g} %", 100.0 * *e.excitation) : "",
               e.identifiable ? (e.fixed ? "known" : "") : "these data do not identify it"});
  std::string text =
      table.text() + "\n  excited: the share of a parameter's effect on these data that no other parameter can explain";
  for (const model::Effect& effect : found.model.effects)
    if (const std::string reference = reference_text(effect.type, found.model.drive); !reference.empty())
      text += fmt::format("\n  {}: {}", effect.id, reference);
  return text;
}

std::string errors(const estimation::Identification& found) {
  Table table({"balance", "rmse", "unit", "samples", "condition"}, "lrlrr");
  for (const estimation::BalanceFit& fit : found.fits)
    table.row({catalogue::balance_name(fit.balance), number(fit.rmse()), torque_unit(found.model.drive.axis),
               fmt::format("{}", fit.residual.size()), number(fit.condition_number)});
  return table.text();
}

}  // namespace

std::string torque_unit(data::Axis axis) {
  return axis == data::Axis::rotary ? "N*m" : "N";
}

namespace {

// Which velocity was taken where a record has both a position and a velocity.
std::string velocity_text(const estimation::PreparedData& prepared) {
  if (prepared.pipeline.derivatives == estimation::Derivatives::kalman) {
    double lowest = 0.0, highest = 0.0;
    for (const estimation::Record& record : prepared.records) {
      if (!(record.smoother_corner_hz > 0.0)) continue;
      lowest = lowest > 0.0 ? std::min(lowest, record.smoother_corner_hz) : record.smoother_corner_hz;
      highest = std::max(highest, record.smoother_corner_hz);
    }
    if (!(highest > 0.0)) return "; no motor position to smooth: its velocity is filtered";
    const std::string corner = highest - lowest < 0.005 * highest ? fmt::format("{:.3g}", highest)
                                                                  : fmt::format("{:.3g} to {:.3g}", lowest, highest);
    return fmt::format(
        "; positions are not filtered, but their velocity and acceleration are those of a Kalman filter with "
        "Rauch-Tung-Striebel smoothing, of a corner of {} Hz at the motor, the most likely one",
        corner);
  }
  std::size_t both = 0, fused = 0;
  double highest_hz = 0.0;
  for (const estimation::Record& record : prepared.records) {
    if (!record.experiment->has(data::Column::motor_position) || !record.experiment->has(data::Column::motor_velocity))
      continue;
    ++both;
    if (record.velocity_crossover_hz > 0.0) ++fused;
    highest_hz = std::max(highest_hz, record.velocity_crossover_hz);
  }
  if (both == 0) return {};
  if (fused == 0)
    return "; the motor's velocity is the derivative of its position, as the measured one has no less noise or differs "
           "from it";
  return fmt::format(
      "; the motor's velocity is the measured one above {:.3g} Hz, where it has less noise than the "
      "derivative of the position{}",
      highest_hz, fused < both ? fmt::format(" (in {} of {} records)", fused, both) : "");
}

}  // namespace

std::string pipeline_text(const estimation::PreparedData& prepared) {
  const estimation::Pipeline& p = prepared.pipeline;
  std::size_t used = 0, masked = 0, held = 0, held_by_assumption = 0;
  std::vector<std::string> decimations;
  for (const estimation::Record& record : prepared.records) {
    if (!record.effort.empty()) {
      const estimation::Rows& rows = record.rows[estimation::index(estimation::Balance::motor)];
      used += rows.samples.size();
      masked += rows.masked;
    }
    const std::string decimation = fmt::format("{}", record.decimation);
    if (std::find(decimations.begin(), decimations.end(), decimation) == decimations.end())
      decimations.push_back(decimation);
    if (record.experiment->current_hold == data::CurrentHold::zoh && !record.effort.empty()) {
      ++held;
      if (!record.experiment->current_hold_stated) ++held_by_assumption;
    }
  }
  const std::string of_positions = p.derivatives == estimation::Derivatives::kalman
                                       ? ""
                                       : fmt::format(", {:.4g} Hz for positions", p.motion_cutoff_hz);
  std::string text =
      fmt::format("filters: {:.4g} Hz for the regression{}; {}", p.row_cutoff_hz, of_positions, p.reason);
  text += decimations == std::vector<std::string>{"1"}
              ? "; every sample is used"
              : fmt::format("; one sample in {} is used", listed(decimations, "or"));
  text += velocity_text(prepared);
  const double share =
      used + masked > 0 ? 100.0 * static_cast<double>(masked) / static_cast<double>(used + masked) : 0.0;
  text += p.mask
              ? fmt::format("; {:.1f} % of the motor balance's samples masked (reversals, sticking, clipping)", share)
              : std::string("; no mask for reversals and sticking");
  if (held > 0)
    text += fmt::format(
        "; effort moved by half a sample in {} of {} experiments, as a drive holds it{}", held, prepared.records.size(),
        held_by_assumption > 0 ? " (assumed: current_hold = \"none\" in dataset.toml turns it off)" : "");
  return text;
}

std::string identification_text(const estimation::Identification& found) {
  std::string text = by_experiment(found);
  text += (text.empty() ? "" : "\n\n") + pooled(found);
  if (!found.derived.empty()) {
    Table table({"derived", "value", "unit"}, "lrl");
    for (const estimation::Derived& d : found.derived) table.row({d.name, number(d.value), d.unit});
    text += "\n\n" + table.text();
  }
  return text + "\n\n" + errors(found) + "\n\n" +
         wrapped(words_on(found.model.drive.axis, pipeline_text(found.prepared)));
}

std::vector<std::string> warnings_of(const estimation::Identification& found) {
  std::vector<std::string> warnings;
  for (const std::string& warning : found.warnings) warnings.push_back(words_on(found.model.drive.axis, warning));
  return warnings;
}

json identification_json(const estimation::Identification& found, const std::string& intervals) {
  json parameters = json::array();
  for (const Estimate& e : found.estimates) {
    json parameter = json_parameter(e);
    add_by_experiment(parameter, e);
    parameter["identifiable"] = e.identifiable;
    parameter["excitation"] = json_number(e.excitation);
    parameter["change_at_twice_cutoff"] = json_number(e.change_at_twice_cutoff);
    parameters.push_back(std::move(parameter));
  }
  json derived = json::array();
  for (const estimation::Derived& d : found.derived) {
    json one = {{"name", d.name}, {"value", json_number(d.value)}, {"unit", d.unit}};
    add_by_experiment(one, d);
    derived.push_back(std::move(one));
  }
  json balances = json::array();
  for (const estimation::BalanceFit& fit : found.fits)
    balances.push_back({{"balance", catalogue::balance_name(fit.balance)},
                        {"rmse", json_number(fit.rmse())},
                        {"unit", torque_unit(found.model.drive.axis)},
                        {"rows", fit.residual.size()},
                        {"autocorrelation_time", json_number(fit.autocorrelation_time)}});
  const estimation::Pipeline& p = found.prepared.pipeline;
  return {{"format", "flexspline-identify/1"},
          {"method", found.method},
          {"intervals", intervals},
          {"cutoff_hz", json_number(p.row_cutoff_hz)},
          {"motion_cutoff_hz", json_number(p.motion_cutoff_hz)},
          {"derivatives", p.derivatives == estimation::Derivatives::kalman ? "kalman" : "butterworth"},
          {"cutoff_reason", words_on(found.model.drive.axis, p.reason)},
          {"parameters", std::move(parameters)},
          {"derived", std::move(derived)},
          {"balances", std::move(balances)},
          {"condition_number", json_number(found.condition_number)},
          {"warnings", warnings_of(found)}};
}

}  // namespace flexspline::output
