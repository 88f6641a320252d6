#include "host/app/cli/inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/common/text/nearest.hpp"
#include "host/engine/estimation/terms.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;

bool is_same(const data::Experiment& a, const data::Experiment& b) {
  std::error_code error;
  return fs::equivalent(a.file, b.file, error) && a.size() == b.size() && a.size() > 0 && a.time_s[0] == b.time_s[0];
}

void hold_out(data::Dataset& dataset, data::Dataset held) {
  for (data::Experiment& e : held.experiments) {
    e.role = data::Role::holdout;
    const auto twin = std::find_if(dataset.experiments.begin(), dataset.experiments.end(),
                                   [&](const data::Experiment& x) { return is_same(x, e); });
    if (twin != dataset.experiments.end()) {
      twin->role = data::Role::holdout;
      continue;
    }
    const std::string name = e.name;
    const auto taken = [&] {
      return std::any_of(dataset.experiments.begin(), dataset.experiments.end(),
                         [&](const data::Experiment& x) { return x.name == e.name; });
    };
    for (int number = 2; taken(); ++number) e.name = fmt::format("{}-{}", name, number);
    dataset.experiments.push_back(std::move(e));
  }
  dataset.findings.insert(dataset.findings.end(), held.findings.begin(), held.findings.end());
}

}  // namespace

data::Dataset load(const DataInputs& inputs, Console& console) {
  console.progress("reading the measurements");
  data::Dataset dataset = data::load(inputs.data, {inputs.tolerate, false});
  if (!inputs.holdout.empty()) {
    // Units are converted by the axis, which one of both alone may state.
    data::Dataset held = data::load(inputs.holdout, {inputs.tolerate, true, dataset.drive.axis});
    if (!dataset.drive.axis && held.drive.axis == data::Axis::linear)
      dataset = data::load(inputs.data, {inputs.tolerate, false, held.drive.axis});
    data::merge_facts(dataset.drive, held.drive, {"the data", "those held out", "give measurements of one drive"},
                      held.drive.axis.value_or(data::Axis::rotary));
    hold_out(dataset, std::move(held));
  }
  for (const std::string& text : data::warning_texts(dataset.findings)) console.warn(text);
  return dataset;
}

model::ModelFile load_model(const fs::path& path) {
  return model::read(path, catalogue::known_effects());
}

model::Model load_identified_model(const fs::path& path) {
  model::Model model = load_model(path).model;
  std::string missing;
  for (const model::Effect& effect : model.effects)
    for (const std::string& parameter : catalogue::missing_values(effect))
      missing += (missing.empty() ? "" : ", ") + effect.id + "." + parameter;
  if (!missing.empty())
    throw UsageError(fmt::format("{}: no value for {}; run flexspline identify first", path.string(), missing));
  return model;
}

model::ModelFile load_searched_model(const fs::path& path) {
  // The time of a search grows with their square and more.
  constexpr std::ptrdiff_t kMostEstimated = 250;
  model::ModelFile file = load_model(path);
  std::ptrdiff_t estimated = 0;
  for (const estimation::Term& term : estimation::terms_of(file.model))
    estimated += std::count(term.known.begin(), term.known.end(), 0);
  if (estimated > kMostEstimated)
    throw UsageError(
        fmt::format("{}: {} parameters are to be estimated, and this command searches with at most {}; take "
                    "effects out, or state those that you know with fixed = true",
                    path.string(), estimated, kMostEstimated));
  return file;
}

std::string quoted(const std::string& argument) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=,+@%";
  if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos) return argument;
  std::string text = "'";
  for (const char c : argument) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::string as_arguments(const std::vector<fs::path>& paths) {
  std::string text;
  for (const fs::path& path : paths) text += (text.empty() ? "" : " ") + quoted(path.string());
  return text;
}

std::string tolerate_arguments(const std::vector<std::string>& kinds) {
  std::string text;
  for (const std::string& kind : kinds) text += " --tolerate " + quoted(kind);
  return text;
}

std::string as_arguments(const DataInputs& inputs, const PipelineInputs& pipeline) {
  const PipelineInputs usual;
  std::string text = as_arguments(inputs.data) + tolerate_arguments(inputs.tolerate);
  if (!inputs.holdout.empty()) text += " --holdout " + as_arguments(inputs.holdout);
  if (pipeline.cutoff_hz) text += fmt::format(" --cutoff-hz {}", *pipeline.cutoff_hz);
  if (pipeline.mask != usual.mask) text += " --mask " + pipeline.mask;
  if (pipeline.derivatives != usual.derivatives) text += " --derivatives " + pipeline.derivatives;
  return text;
}

void require_effect(const std::string& name) {
  if (catalogue::find(name) != nullptr || catalogue::description_of(name) != nullptr) return;
  std::vector<std::string_view> names = {catalogue::kTableEffect, catalogue::kExpressionEffect};
  for (const catalogue::Entry& entry : catalogue::all()) names.push_back(entry.name());
  const std::string near = text::nearest_or_first_words(name, names);
  throw UsageError(fmt::format("there is no effect \"{}\"; {}flexspline effects lists all", name,
                               near.empty() ? "" : fmt::format("did you mean {}? ", near)));
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    throw UsageError(fmt::format("{} is there and no folder; give another --out", folder.string()));
  fs::create_directories(folder, error);
  if (error)
    throw UsageError(fmt::format("{}: the folder could not be created: {}; check the path and its permissions",
                                 folder.string(), error.message()));
}

void require_empty_folder(const fs::path& folder, bool force) {
  std::error_code error;
  if (!force && fs::is_directory(folder, error) && !fs::is_empty(folder, error))
    throw UsageError(folder.string() + ": is there and not empty; give another folder, or --force");
}

}  // namespace flexspline::cli
