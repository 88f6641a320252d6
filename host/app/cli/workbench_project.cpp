#include "host/app/cli/workbench_project.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "host/app/cli/inputs.hpp"
#include "host/app/project/first_project.hpp"
#include "host/common/text/nearest.hpp"
#include "host/input/data/recording.hpp"
#include "host/input/data/units.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;
using data::Column;
using nlohmann::json;
using project::ColumnGuess;
using project::Draft;
using project::FirstProject;
using project::Request;
using project::Side;

// Signals of a file that are drawn; a logger of a robot writes hundreds.
constexpr std::size_t kMostDrawn = 120;
// Each gives its least and its largest value.
constexpr std::size_t kBuckets = 120;

Request request_of(const std::vector<fs::path>& files, const workbench::Choices& choices, const fs::path& out) {
  Request request;
  request.data = files;
  request.tolerate = choices.tolerate;
  request.out = out;
  request.map = choices.map;
  request.without = choices.without;
  request.turned = choices.turned;
  request.axis = choices.axis;
  request.position_side = choices.position_side;
  request.joint = choices.joint;
  request.pole_pairs = choices.pole_pairs;
  request.gear_ratio = choices.gear_ratio;
  request.torque_constant_nm_a = choices.torque_constant_nm_a;
  request.encoder_counts = choices.encoder_counts;
  request.pitch_m = choices.pitch_m;
  return request;
}

// Five digits are more than a picture shows.
json rounded(double value) {
  if (!std::isfinite(value)) return nullptr;
  if (value == 0.0) return 0.0;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 4.0);
  return unit > 0.0 ? std::round(value / unit) * unit : value;
}

json picture(const std::vector<double>& values) {
  json low = json::array(), high = json::array();
  double least = std::numeric_limits<double>::infinity(), largest = -least;
  const std::size_t buckets = std::min(kBuckets, values.size());
  for (std::size_t b = 0; b < buckets; ++b) {
    double a = std::numeric_limits<double>::infinity(), z = -a;
    for (std::size_t k = b * values.size() / buckets; k < (b + 1) * values.size() / buckets; ++k) {
      if (!std::isfinite(values[k])) continue;
      a = std::min(a, values[k]);
      z = std::max(z, values[k]);
    }
    low.push_back(a <= z ? rounded(a) : json());
    high.push_back(a <= z ? rounded(z) : json());
    least = std::min(least, a);
    largest = std::max(largest, z);
  }
  return {{"low", std::move(low)},
          {"high", std::move(high)},
          {"least", least <= largest ? rounded(least) : json()},
          {"largest", least <= largest ? rounded(largest) : json()}};
}

// The columns of a file, those that are used first, with pictures of the first so many.
json signals_of(const fs::path& file, const Draft& draft) {
  data::Findings findings;
  const std::unique_ptr<data::Recording> recording = data::open_recording(file, findings);
  const std::vector<std::string>& names = recording->names();
  std::vector<std::size_t> order(names.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  const auto is_used = [&](std::size_t k) {
    const std::string plain = data::without_element(names[k]).name;
    return std::any_of(draft.columns.begin(), draft.columns.end(),
                       [&](const ColumnGuess& c) { return c.theirs == plain; }) ||
           std::find(draft.there.begin(), draft.there.end(), plain) != draft.there.end();
  };
  std::stable_partition(order.begin(), order.end(), is_used);
  json signals = json::array();
  std::set<std::string> listed;
  for (const std::size_t k : order) {
    const std::string name = data::without_element(names[k]).name;
    if (name.empty() || !listed.insert(name).second) continue;
    json signal = {{"name", name}, {"unit", recording->unit(k)}};
    if (signals.size() < kMostDrawn) {
      const std::size_t one[] = {k};
      signal.update(picture(recording->read(one).columns[0]));
    }
    signals.push_back(std::move(signal));
  }
  return signals;
}

json units_of(data::Quantity quantity) {
  json units = json::array();
  const std::string known = data::known_units(quantity);
  for (std::size_t from = 0; from < known.size();) {
    const std::size_t to = std::min(known.find(", ", from), known.size());
    const std::string name = known.substr(from, to - from);
    const data::Unit unit = data::unit_from_text(name).value_or(data::Unit{});
    const bool counts = unit.quantity == data::Quantity::counts || unit.quantity == data::Quantity::counts_rate;
    units.push_back({{"unit", name}, {"factor", counts ? json() : json(unit.factor)}, {"offset", unit.offset}});
    from = to + 2;
  }
  return units;
}

// Each column of ours with what it is taken from.
json columns_of(const Draft& draft, data::Axis axis) {
  json columns = json::array();
  const auto add = [&](const std::string& ours, data::Quantity quantity) {
    json column = {{"column", ours}, {"units", units_of(quantity)}, {"source", nullptr}};
    for (const ColumnGuess& c : draft.columns)
      if (c.ours == ours)
        column.update(
            {{"source", c.theirs}, {"unit", c.unit}, {"scale", c.scale}, {"why", c.why}, {"stated", c.why.empty()}});
    if (column["source"].is_null() && std::find(draft.there.begin(), draft.there.end(), ours) != draft.there.end())
      column.update({{"source", ours}, {"unit", ""}, {"scale", 1.0}, {"why", ""}, {"stated", true}});
    columns.push_back(std::move(column));
  };
  add("time_s", data::Quantity::time);
  for (std::size_t c = 0; c < data::kColumns; ++c)
    add(std::string(data::column_name(static_cast<Column>(c))), data::quantity_of(static_cast<Column>(c), axis));
  return columns;
}

json finding_json(const data::Finding& f) {
  const auto known = data::known_kinds();
  const auto kind = std::find_if(known.begin(), known.end(), [&](const auto& k) { return k.name == f.kind; });
  const bool tolerable = kind != known.end() && kind->tolerable && f.remedy.find("--tolerate") != std::string::npos;
  return {{"file", fs::path(f.file).filename().string()},
          {"line", f.line},
          {"column", f.column},
          {"what", f.what},
          {"remedy", f.remedy},
          {"tolerate", tolerable ? json(f.kind) : json()}};
}

std::string side_name(const std::optional<Side>& side) {
  if (!side) return "";
  return *side == Side::link ? "link" : *side == Side::motor ? "motor" : "open";
}

json number_of(const data::KeyMap& keys, const char* key) {
  const auto found = keys.find(key);
  return found != keys.end() && found->second.number ? output::json_number(*found->second.number) : json();
}

// How the draft fares with the values in the files: the first model, or what is in its way.
json outlook(Draft& draft, const Request& request) {
  json answer = {{"can_begin", false},        {"why_not", ""},
                 {"findings", json::array()}, {"warnings", json::array()},
                 {"effects", json::array()},  {"reasons", json::array()}};
  try {
    const FirstProject project = first_project(draft, request);
    answer["can_begin"] = true;
    answer["warnings"] = project.warnings;
    answer["reasons"] = project.base.reasons;
    for (const model::Effect& effect : project.base.model.effects) answer["effects"].push_back(effect.type);
    // The facts in the files themselves, too.
    answer["gear_ratio"] = output::json_number(project.dataset.drive.gear_ratio);
    answer["torque_constant_nm_a"] = output::json_number(project.dataset.drive.torque_constant_nm_a);
    answer["pitch_m"] = output::json_number(project.dataset.drive.pitch_m);
  } catch (const data::DataError& unusable) {
    for (const data::Finding& f : unusable.findings())
      if (f.severity == data::Severity::error) answer["findings"].push_back(finding_json(f));
    answer["why_not"] = "the measurements cannot be used like this";
  } catch (const project::RequestError& open) {
    answer["why_not"] = open.what();
  }
  return answer;
}

json propose(const std::vector<fs::path>& files, const workbench::Choices& choices) {
  const Request request = request_of(files, choices, "project");
  Draft draft = draft_of(request);
  json proposal = outlook(draft, request);
  const auto axis = draft.toml.drive.find("axis");
  const bool linear = axis != draft.toml.drive.end() && axis->second.text == "linear";
  json names = json::array();
  for (const data::ExperimentEntry& entry : draft.toml.experiments)
    if (names.empty() || names.back() != entry.file.filename().string())
      names.push_back(entry.file.filename().string());
  proposal.update({{"format", "flexspline-proposal/1"},
                   {"files", std::move(names)},
                   {"columns", columns_of(draft, linear ? data::Axis::linear : data::Axis::rotary)},
                   {"signals", signals_of(draft.toml.experiments.front().file, draft)},
                   {"axis", linear ? "linear" : "rotary"},
                   {"position_side", side_name(draft.side)},
                   {"question", draft.open_question},
                   {"joints", draft.joints},
                   {"joint", draft.joint ? json(*draft.joint) : json()},
                   {"needs_pole_pairs", draft.needs_pole_pairs},
                   {"encoder_counts", number_of(draft.toml.defaults, "encoder_counts")},
                   {"notes", draft.notes},
                   {"has_dataset_toml", draft.from_toml}});
  for (const char* fact : {"gear_ratio", "torque_constant_nm_a", "pitch_m"})
    if (!proposal.contains(fact)) proposal[fact] = number_of(draft.toml.drive, fact);
  return proposal;
}

workbench::Project make(const std::vector<fs::path>& files, const workbench::Choices& choices, const fs::path& folder,
                        const fs::path& home) {
  const Request request = request_of(files, choices, folder);
  Draft draft = draft_of(request);
  FirstProject first = first_project(draft, request);
  first.base.model.name = files.front().stem().string();
  make_folder(folder);
  model::save(folder / "dataset.toml", text_of(draft, folder));
  const bool is_inside = std::all_of(files.begin(), files.end(),
                                     [&](const fs::path& file) { return fs::absolute(file).parent_path() == folder; });
  return {std::make_shared<data::Dataset>(data::load({folder / "dataset.toml"}, {choices.tolerate, false})),
          text_of(first.base), text_of(draft, is_inside ? folder : home)};
}

}  // namespace

workbench::Projects projects(const fs::path& home) {
  return {propose, [home](const std::vector<fs::path>& files, const workbench::Choices& choices,
                          const fs::path& folder) { return make(files, choices, folder, home); }};
}

}  // namespace flexspline::cli
