#include "host/input/data/keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "host/common/text/nearest.hpp"

namespace flexspline::data {
namespace {

constexpr std::array<std::string_view, 6> kDriveKeys = {"axis",    "gear_ratio", "torque_constant_nm_a",
                                                        "pitch_m", "pole_pairs", "motor_slots"};
constexpr std::array<std::string_view, 9> kExperimentKeys = {"experiment",
                                                             "load",
                                                             "role",
                                                             "replicate_of",
                                                             "encoder_counts",
                                                             "output_encoder_counts",
                                                             "motor_position_zero",
                                                             "output_position_zero",
                                                             "current_hold"};
constexpr std::string_view kNoise = "noise_std_";

std::optional<double> number_from_text(std::string_view text) {
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

bool same(const KeyValue& a, const KeyValue& b) {
  if (a.number && b.number) return std::abs(*a.number - *b.number) <= 1e-9 * std::abs(*a.number);
  return a.text == b.text;
}

void wrong_value(const std::string& key, const KeyValue& value, const std::string& allowed, Findings& findings) {
  findings.add(Severity::error, "key", value.file, value.line, "", fmt::format("{} cannot be \"{}\"", key, value.text),
               fmt::format("write {}", allowed));
}

template <typename Choice, std::size_t n>
std::optional<Choice> choice(const std::string& key, const KeyValue& value,
                             const std::pair<std::string_view, Choice> (&options)[n], Findings& findings) {
  std::string names;
  for (const auto& [name, option] : options) {
    if (name == value.text) return option;
    names += (names.empty() ? "" : " or ") + std::string(name);
  }
  wrong_value(key, value, names, findings);
  return std::nullopt;
}

std::optional<double> positive(const std::string& key, const KeyValue& value, Findings& findings) {
  if (value.number && *value.number > 0.0) return value.number;
  wrong_value(key, value, "a number above zero, with a decimal point", findings);
  return std::nullopt;
}

std::optional<double> counted(const std::string& key, const KeyValue& value, Findings& findings) {
  if (value.number && *value.number >= 1.0 && *value.number <= kMostCounted &&
      *value.number == std::floor(*value.number))
    return value.number;
  wrong_value(key, value, fmt::format("a whole number from 1 to {:g}", kMostCounted), findings);
  return std::nullopt;
}

constexpr std::pair<std::string_view, PositionZero> kZeros[] = {
    {"absolute", PositionZero::absolute}, {"index", PositionZero::index}, {"none", PositionZero::none}};

}  // namespace

bool is_drive_key(std::string_view key) {
  return std::find(kDriveKeys.begin(), kDriveKeys.end(), key) != kDriveKeys.end();
}

bool is_experiment_key(std::string_view key) {
  if (key.starts_with(kNoise)) return column_from_name(key.substr(kNoise.size())).has_value();
  return std::find(kExperimentKeys.begin(), kExperimentKeys.end(), key) != kExperimentKeys.end();
}

std::string nearest_key(std::string_view key) {
  std::vector<std::string_view> known(kDriveKeys.begin(), kDriveKeys.end());
  known.insert(known.end(), kExperimentKeys.begin(), kExperimentKeys.end());
  std::vector<std::string> noise;
  for (std::size_t i = 0; i < kColumns; ++i)
    noise.push_back(std::string(kNoise) + std::string(column_name(static_cast<Column>(i))));
  known.insert(known.end(), noise.begin(), noise.end());
  return text::nearest(key, known);
}

KeyMap keys_of_header(const std::vector<HeaderKey>& lines, const std::string& file, Findings& findings) {
  KeyMap keys;
  for (const HeaderKey& line : lines) {
    if (is_drive_key(line.key) || is_experiment_key(line.key)) {
      const KeyValue value{line.value, number_from_text(line.value), file, line.line};
      const auto [at, inserted] = keys.emplace(line.key, value);
      if (!inserted && !same(at->second, value))
        findings.add(Severity::warning, "key_differs", file, line.line, "",
                     fmt::format("{} is in the header twice: \"{}\" in line {} is used, \"{}\" is not", line.key,
                                 at->second.text, at->second.line, line.value),
                     "take one of them out");
      continue;
    }
    // "# date: ..." is a comment; only a text that is nearly a key gets a warning.
    const std::string near = nearest_key(line.key);
    if (!near.empty() && (line.key.find('_') != std::string::npos || line.key.size() + 1 >= near.size()) &&
        line.key.find(' ') == std::string::npos)
      findings.add(Severity::warning, "unknown_key", file, line.line, "",
                   fmt::format("the key {} is not known and is ignored", line.key),
                   fmt::format("did you mean {}?", near));
  }
  return keys;
}

KeyMap merged(const KeyMap& winner, const KeyMap& loser, Findings& findings) {
  KeyMap all = winner;
  for (const auto& [key, value] : loser) {
    const auto [at, inserted] = all.emplace(key, value);
    if (!inserted && !same(at->second, value))
      findings.add(Severity::warning, "key_differs", value.file, value.line, "",
                   fmt::format("{} is {} here and {} in {}:{}, which wins", key, value.text, at->second.text,
                               at->second.file, at->second.line),
                   "make them agree");
  }
  return all;
}

void apply_drive_keys(const KeyMap& keys, DriveFacts& drive, Findings& findings) {
  const auto conflict = [&](const std::string& key, const KeyValue& value, const std::string& before) {
    findings.add(Severity::error, "conflict", value.file, value.line, "",
                 fmt::format("{} is {} here, but {} in another place of the same data set", key, value.text, before),
                 "measurements of different drives do not go together: load them one by one");
  };
  for (const auto& [key, value] : keys) {
    if (key == "axis") {
      const std::optional<Axis> axis =
          choice<Axis>(key, value, {{"rotary", Axis::rotary}, {"linear", Axis::linear}}, findings);
      if (axis && drive.axis && *axis != *drive.axis)
        conflict(key, value, *drive.axis == Axis::rotary ? "rotary" : "linear");
      else if (axis)
        drive.axis = axis;
      continue;
    }
    std::optional<double>* fact = nullptr;
    if (key == "gear_ratio") fact = &drive.gear_ratio;
    if (key == "torque_constant_nm_a") fact = &drive.torque_constant_nm_a;
    if (key == "pitch_m") fact = &drive.pitch_m;
    if (key == "pole_pairs") fact = &drive.pole_pairs;
    if (key == "motor_slots") fact = &drive.motor_slots;
    if (fact == nullptr) continue;
    const bool is_count = fact == &drive.pole_pairs || fact == &drive.motor_slots;
    const std::optional<double> number = is_count ? counted(key, value, findings) : positive(key, value, findings);
    if (number && *fact && std::abs(*number - **fact) > 1e-3 * std::abs(**fact))
      conflict(key, value, fmt::format("{}", **fact));
    else if (number && !*fact)
      *fact = number;
  }
}

void apply_experiment_keys(const KeyMap& keys, Experiment& experiment, Findings& findings) {
  for (const auto& [key, value] : keys) {
    if (key == "experiment" && !value.text.empty()) experiment.name = value.text;
    if (key == "replicate_of") experiment.replicate_of = value.text;
    if (key == "encoder_counts") experiment.encoder_counts = positive(key, value, findings);
    if (key == "output_encoder_counts") experiment.output_encoder_counts = positive(key, value, findings);
    if (key == "load")
      experiment.load = choice<Load>(key, value, {{"free", Load::free}, {"locked", Load::locked}}, findings)
                            .value_or(experiment.load);
    if (key == "role")
      experiment.role = choice<Role>(key, value, {{"fit", Role::fit}, {"holdout", Role::holdout}}, findings)
                            .value_or(experiment.role);
    if (key == "current_hold") {
      experiment.current_hold_stated = true;
      experiment.current_hold =
          choice<CurrentHold>(key, value, {{"zoh", CurrentHold::zoh}, {"none", CurrentHold::none}}, findings)
              .value_or(experiment.current_hold);
    }
    if (key == "motor_position_zero")
      experiment.motor_position_zero = choice(key, value, kZeros, findings).value_or(experiment.motor_position_zero);
    if (key == "output_position_zero")
      experiment.output_position_zero = choice(key, value, kZeros, findings).value_or(experiment.output_position_zero);
    if (key.starts_with(kNoise))
      experiment.noise_std[static_cast<std::size_t>(*column_from_name(key.substr(kNoise.size())))] =
          positive(key, value, findings);
  }
}

}  // namespace flexspline::data
