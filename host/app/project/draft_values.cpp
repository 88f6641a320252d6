#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/app/project/draft.hpp"
#include "host/common/system/temporary_folder.hpp"
#include "host/input/data/period.hpp"
#include "host/input/data/record_summary.hpp"
#include "host/input/data/record_time.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/model/text.hpp"

namespace flexspline::project {
namespace {

namespace fs = std::filesystem;
using data::Column;

// Each part of a split record must be long enough to be evaluated.
constexpr std::size_t kFewestSamplesOfAPart = 500;

void replace_all(std::string& text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
}

// Slope of the motor's position over the output's, over all free experiments.
std::optional<double> gear_ratio_of(const data::Dataset& dataset) {
  double cross = 0.0, square = 0.0, motor_square = 0.0;
  for (const data::Experiment& e : dataset.experiments) {
    if (e.load == data::Load::locked || !e.has(Column::motor_position) || !e.has(Column::output_position)) continue;
    const std::vector<double>& q = e[Column::motor_position];
    const std::vector<double>& o = e[Column::output_position];
    double q_mean = 0.0, o_mean = 0.0;
    for (std::size_t k = 0; k < q.size(); ++k) q_mean += q[k], o_mean += o[k];
    q_mean /= static_cast<double>(q.size());
    o_mean /= static_cast<double>(q.size());
    for (std::size_t k = 0; k < q.size(); ++k) {
      cross += (q[k] - q_mean) * (o[k] - o_mean);
      square += (o[k] - o_mean) * (o[k] - o_mean);
      motor_square += (q[k] - q_mean) * (q[k] - q_mean);
    }
  }
  if (!(square > 0.0) || cross * cross < 0.99 * square * motor_square) return std::nullopt;
  const double slope = cross / square;
  const double whole = std::round(slope);
  return std::abs(slope - whole) < 0.005 * std::abs(slope) ? whole : slope;
}

struct Split {
  double at_s = 0.0;
  std::string why;
};

std::optional<Split> split_of(const data::Experiment& e) {
  const std::size_t n = e.size();
  if (n < 2 * kFewestSamplesOfAPart) return std::nullopt;
  if (const auto period = data::period_samples(e)) {
    const double periods = static_cast<double>(n) / *period;
    const double sample = std::round(std::round(periods) / 2.0) * *period;
    if (sample >= static_cast<double>(kFewestSamplesOfAPart) &&
        sample + static_cast<double>(kFewestSamplesOfAPart) <= static_cast<double>(n))
      return Split{
          e.time_s.front() + sample * e.sample_s,
          fmt::format("the motion repeats itself every {:.6g} s: the cut is on a whole period. The second part "
                      "repeats the first, so it shows repeatability more than generality",
                      *period * e.sample_s)};
  }
  // The standstill next to the middle; a cut there leaves both filters quiet.
  const std::vector<double> velocity = data::velocity_of(e);
  double fastest = 0.0;
  for (const double v : velocity) fastest = std::max(fastest, std::abs(v));
  std::size_t best = n / 2;
  bool at_rest = false;
  for (std::size_t d = 0; d < n / 4 && !at_rest && !velocity.empty(); ++d)
    for (const std::size_t k : {n / 2 - d, n / 2 + d})
      if (!at_rest && std::abs(velocity[k]) < 0.01 * fastest) {
        best = k;
        at_rest = true;
      }
  return Split{e.time_s[best],
               at_rest ? "the motion does not repeat itself: the cut is at the standstill next to the middle"
                       : "the motion does not repeat itself: the cut is in the middle"};
}

void split(Draft& draft, const data::Dataset& dataset) {
  const data::Experiment& e = dataset.experiments.front();
  const auto cut = split_of(e);
  if (!cut) {
    draft.notes.push_back(
        fmt::format("\"{}\" is too short to be split; record a second experiment to verify on", e.name));
    return;
  }
  // As many digits as the sampling resolves.
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(e.sample_s))) + 1, 0, 9);
  const double at_s = std::strtod(fmt::format("{:.{}f}", cut->at_s, digits).c_str(), nullptr);
  data::ExperimentEntry first = draft.toml.experiments.front();
  data::ExperimentEntry second = first;
  first.to_s = at_s;
  second.from_s = at_s;
  first.keys["experiment"] = text_value(e.name + "-fit");
  first.keys["role"] = text_value("fit");
  second.keys["experiment"] = text_value(e.name + "-holdout");
  second.keys["role"] = text_value("holdout");
  draft.toml.experiments = {first, second};
  draft.notes.push_back(fmt::format("\"{}\" is split at {} into a part to fit and a part to verify; {}", e.name,
                                    data::time_text(e, at_s), cut->why));
}

std::string key_line(const std::string& key, const data::KeyValue& value) {
  return fmt::format("{} = {}", key, value.number ? model::exact_text(*value.number) : model::toml_string(value.text));
}

std::string remark(const std::string& comment) {
  return comment.empty() ? "" : fmt::format("  # {}", comment);
}

}  // namespace

data::Dataset load_draft(const Draft& draft, const Request& request) {
  const system::TemporaryFolder folder;
  const fs::path file = folder.path() / "dataset.toml";
  model::save(file, text_of(draft, {}));
  // Messages name the file that is going to be, not the one that is gone.
  const auto renamed = [&](std::vector<data::Finding> findings) {
    for (data::Finding& f : findings)
      for (std::string* text : {&f.file, &f.what, &f.remedy})
        replace_all(*text, file.string(), (request.out / "dataset.toml").string());
    return findings;
  };
  try {
    data::Dataset dataset = data::load({file}, {request.tolerate, false});
    dataset.findings = renamed(std::move(dataset.findings));
    return dataset;
  } catch (const data::DataError& error) {
    throw data::DataError(renamed(error.findings()));
  }
}

void take_facts_of_values(Draft& draft, data::Dataset& dataset) {
  if (!dataset.drive.gear_ratio) {
    const auto ratio = gear_ratio_of(dataset);
    if (ratio && *ratio > 0.0) {
      dataset.drive.gear_ratio = *ratio;
      draft.toml.drive["gear_ratio"] = {model::exact_text(*ratio), *ratio, "", 0};
      draft.gear_comment = "guess: slope of motor position over output position";
      draft.notes.push_back(
          fmt::format("the gear ratio is {:g}, by the slope of motor position over output position", *ratio));
    } else if (ratio) {
      draft.notes.push_back(
          "the output turns against the motor: a positive motor motion must turn it positively; write scale = -1 under "
          "[columns.output_position_rad], or give --turn output_position_rad");
    }
  }
  if (dataset.has(Column::current) && !dataset.drive.torque_constant_nm_a)
    draft.notes.push_back(
        "the torque constant is not known: torques come out in amperes; give --torque-constant, or write "
        "torque_constant_nm_a under [drive]");
  if (dataset.drive.axis == data::Axis::linear && !dataset.drive.pitch_m)
    draft.notes.push_back(
        "the pitch is not known: ripples per motor turn are not tried; give --pitch-m METRES, or write pitch_m under "
        "[drive] (a linear motor has none)");
  const bool one_part = dataset.experiments.size() == 1 && draft.toml.experiments.size() == 1 &&
                        !draft.toml.experiments.front().from_s && !draft.toml.experiments.front().to_s;
  if (one_part && dataset.experiments.front().role == data::Role::fit) {
    split(draft, dataset);
  } else if (std::none_of(dataset.experiments.begin(), dataset.experiments.end(),
                          [](const data::Experiment& e) { return e.role == data::Role::holdout; })) {
    draft.notes.push_back(
        "no experiment is held out: write role = \"holdout\" under the one to verify on, of a motion that differs");
  }
}

std::vector<std::string> implausible_sides(const Draft& draft, const data::Dataset& dataset) {
  // The fastest motors of strain-wave drives turn at some 14,000 rpm; an arm that never moves faster than a clock's
  // second hand is none that friction is identified on.
  constexpr double kFastestMotor_rad_s = 1500.0, kSlowestLink_rad_s = 0.02;
  if (!draft.side || dataset.drive.axis == data::Axis::linear) return {};
  const double ratio = dataset.drive.gear_ratio.value_or(1.0);
  double fastest = 0.0;
  for (const data::Experiment& e : dataset.experiments)
    if (const auto speed = data::summary_of(e, data::Axis::rotary).highest_speed) fastest = std::max(fastest, *speed);
  const bool scaled = *draft.side == Side::link && ratio != 1.0;
  if (scaled && fastest > kFastestMotor_rad_s)
    return {
        fmt::format("with position and velocity of the link, the motor would turn at {:.3g} rad/s, faster than any of "
                    "a strain-wave drive; if they are the motor's, give --position-side motor",
                    fastest)};
  if (!scaled && ratio > 1.0 && fastest > 0.0 && fastest / ratio < kSlowestLink_rad_s)
    return {
        fmt::format("with position and velocity of the motor, the link would move at {:.2g} rad/s at most; if they are "
                    "the link's, give --position-side link",
                    fastest / ratio)};
  return {};
}

std::string text_of(const Draft& draft, const fs::path& folder) {
  std::string text = "format = \"flexspline-dataset/1\"\n";
  std::string kinds;
  for (const std::string& kind : draft.toml.tolerate) kinds += (kinds.empty() ? "" : ", ") + model::toml_string(kind);
  if (!kinds.empty()) text += fmt::format("tolerate = [{}]\n", kinds);
  text += "\n[drive]\n";
  for (const auto& [key, value] : draft.toml.drive)
    text += key_line(key, value) +
            remark(key == "axis"         ? draft.axis_comment
                   : key == "gear_ratio" ? draft.gear_comment
                                         : "") +
            "\n";
  if (draft.toml.drive.count("gear_ratio") == 0)
    text += "# gear_ratio = 100             # motor turns per output turn\n";
  if (draft.toml.drive.count("torque_constant_nm_a") == 0)
    text += "# torque_constant_nm_a = 0.05  # where the effort is a current\n";
  const auto axis = draft.toml.drive.find("axis");
  if (axis != draft.toml.drive.end() && axis->second.text == "linear" && draft.toml.drive.count("pitch_m") == 0)
    text += "# pitch_m = 0.01               # travel of one motor turn\n";
  for (const auto& [key, value] : draft.toml.defaults) text += key_line(key, value) + "\n";
  for (const auto& [ours, mapping] : draft.toml.columns) {
    const auto comment = draft.comments.find(ours);
    text += fmt::format("\n[columns.{}]{}\n", ours, remark(comment == draft.comments.end() ? "" : comment->second));
    text += fmt::format("source = {}\n", model::toml_string(mapping.source));
    if (!mapping.unit.empty()) text += fmt::format("unit = {}\n", model::toml_string(mapping.unit));
    if (mapping.scale != 1.0) text += fmt::format("scale = {}\n", model::exact_text(mapping.scale));
    if (mapping.offset != 0.0) text += fmt::format("offset = {}\n", model::exact_text(mapping.offset));
  }
  if (!draft.unused.empty()) text += fmt::format("\n# Not used: {}\n", output::listed(draft.unused));
  for (const data::ExperimentEntry& entry : draft.toml.experiments) {
    std::error_code error;
    const fs::path relative = folder.empty() ? fs::path() : fs::relative(entry.file, folder, error);
    text += fmt::format("\n[[experiment]]\nfile = {}\n",
                        model::toml_string((relative.empty() ? entry.file : relative).generic_string()));
    for (const auto& [key, value] : entry.keys) text += key_line(key == "experiment" ? "name" : key, value) + "\n";
    if (entry.element) text += fmt::format("element = {}\n", *entry.element);
    if (entry.from_s) text += fmt::format("from_s = {}\n", model::exact_text(*entry.from_s));
    if (entry.to_s) text += fmt::format("to_s = {}\n", model::exact_text(*entry.to_s));
  }
  return text;
}

}  // namespace flexspline::project
