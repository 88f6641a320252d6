#include "host/output/report/document.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host/common/text/build_identity.hpp"
#include "host/engine/comparison/compare.hpp"
#include "host/input/data/record_time.hpp"
#include "host/output/answers/comparison.hpp"
#include "host/output/answers/diagnosis.hpp"
#include "host/output/answers/diagnosis_sentences.hpp"
#include "host/output/answers/explanation.hpp"
#include "host/output/answers/identification.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/report/assets.hpp"
#include "host/output/report/page.hpp"
#include "host/output/report/parts.hpp"
#include "host/output/report/view.hpp"

namespace flexspline::report {
namespace {

using nlohmann::json;

std::string title_of(const Subject& subject) {
  const std::string& name = subject.model.name.empty() ? subject.model_name : subject.model.name;
  if (subject.addition)
    return fmt::format("{} {} {}", name, subject.command == "remove" ? "without" : "with", subject.addition->effect);
  if (!subject.rounds.empty()) return fmt::format("What {} lacks", name);
  return fmt::format("How good {} is", name);
}

// Regions repeat what the maps show.
json comparison_json(const comparison::Comparison& comparison) {
  json answer = output::comparison_json(comparison);
  answer.erase("regions");
  return answer;
}

// For the page alone: sentences of the terminal, equations of the candidates, and times as its plots have them.
json diagnosis_json(const selection::Diagnosis& found, const data::Dataset& dataset) {
  json answer = output::diagnosis_json(found);
  answer["verdict_in_words"] = output::verdict_in_words(found);
  answer["error_in_words"] = output::error_in_words(found);
  answer["certainty"] = output::certainty_in_words(found);
  answer["possible_in_words"] = output::possible_in_words(found);
  answer["trends_in_words"] = output::trends_in_words(found);
  answer["sizes"] = json::array();
  for (const selection::NamedEffect& named : found.named)
    if (const selection::Candidate* c = output::candidate_of(found, named); c && c->size)
      answer["sizes"].push_back(output::size_in_words(*c, found.unit));
  for (json& candidate : answer["candidates"]) {
    const catalogue::Entry* entry = catalogue::find(candidate["effect"].get<std::string>());
    candidate["equation"] = entry ? json(entry->info->equation) : json(nullptr);
  }
  for (json& disturbance : answer["disturbances"]) {
    const double start_s = data::start_of_times(dataset, disturbance["experiment"].get<std::string>());
    for (const char* key : {"from_s", "to_s"}) disturbance[key] = disturbance[key].get<double>() - start_s;
  }
  return answer;
}

}  // namespace

json document(const Subject& subject) {
  View view(subject);
  std::size_t held_out = 0;
  for (const comparison::ExperimentResult& e : view.comparison.experiments)
    held_out += e.role == data::Role::holdout ? 1 : 0;
  std::vector<std::string> effects;
  for (const model::Effect& effect : subject.model.effects) effects.push_back(effect.id);
  json rounds = json::array();
  for (const selection::Diagnosis& round : subject.rounds) rounds.push_back(diagnosis_json(round, *subject.dataset));
  const std::time_t now = std::time(nullptr);
  json answer{{"format", "flexspline-report/1"},
              {"title", title_of(subject)},
              {"command", subject.command},
              {"data_set", subject.data_name},
              {"model", {{"file", subject.model_name}, {"name", subject.model.name}, {"effects", effects}}},
              {"tool_version", std::string(kToolVersion)},
              {"tool", text::tool_name()},
              {"created", fmt::format("{:%Y-%m-%d %H:%M UTC}", fmt::gmtime(now))},
              {"experiments", view.comparison.experiments.size()},
              {"held_out", held_out},
              {"pipeline", output::pipeline_text(view.prepared)},
              {"comparison", comparison_json(view.comparison)},
              {"comparison_before", view.comparison_before ? comparison_json(*view.comparison_before) : json(nullptr)},
              {"traces", traces(view)},
              {"maps", residual_maps(view)},
              {"loops", hysteresis_loops(view)},
              {"friction", friction_curve(view)},
              {"rounds", std::move(rounds)},
              {"parameters", parameters(subject, view)},
              {"addition", addition(subject, view)}};
  answer.update(verdict(subject, view));
  return answer;
}

void require_place(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    throw std::runtime_error(fmt::format("--report {}: this is a folder; name a file in it, as in {}", file.string(),
                                         (file / "report.html").string()));
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (!std::filesystem::is_directory(folder, error))
    throw std::runtime_error(
        fmt::format("--report {}: there is no folder {}; make it, or name a file in a folder that is there",
                    file.string(), folder.string()));
}

void write(const std::filesystem::path& file, const Subject& subject) {
  require_place(file);
  model::save(file, page(document(subject)));
}

}  // namespace flexspline::report
