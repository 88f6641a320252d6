#include "host/app/workbench/stored_tabs.hpp"

#include <fmt/format.h>

#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "host/app/workbench/work.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;
using output::json_number;

// An open page waits for a change with a larger number.
constexpr std::uint64_t kMoreChanges = 1'000'000;

std::optional<double> optional_number(const json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

json stored_estimate_json(const estimation::Estimate& e) {
  json per_experiment = json::array();
  for (const estimation::ExperimentValue& v : e.per_experiment)
    per_experiment.push_back({v.name, json_number(v.value), json_number(v.std), v.left_out});
  return {{"slot", {e.ref.term, e.ref.parameter}},
          {"id", e.id},
          {"effect", e.effect},
          {"parameter", e.parameter},
          {"unit", e.unit},
          {"value", json_number(e.value)},
          {"std", json_number(e.std)},
          {"low", json_number(e.low)},
          {"high", json_number(e.high)},
          {"average", json_number(e.average)},
          {"spread_percent", json_number(e.spread_percent)},
          {"reliable", e.reliable ? json(*e.reliable) : json(nullptr)},
          {"identifiable", e.identifiable},
          {"fixed", e.fixed},
          {"excitation", json_number(e.excitation)},
          {"per_experiment", std::move(per_experiment)}};
}

estimation::Estimate estimate_of(const json& stored) {
  estimation::Estimate e;
  e.ref = {stored.at("slot").at(0), stored.at("slot").at(1)};
  e.id = stored.at("id");
  e.effect = stored.at("effect");
  e.parameter = stored.at("parameter");
  e.unit = stored.at("unit");
  e.value = optional_number(stored.at("value")).value_or(std::numeric_limits<double>::quiet_NaN());
  e.std = optional_number(stored.at("std"));
  e.low = optional_number(stored.at("low"));
  e.high = optional_number(stored.at("high"));
  e.average = optional_number(stored.at("average"));
  e.spread_percent = optional_number(stored.at("spread_percent"));
  if (stored.at("reliable").is_boolean()) e.reliable = stored.at("reliable").get<bool>();
  e.identifiable = stored.at("identifiable");
  e.fixed = stored.at("fixed");
  e.excitation = optional_number(stored.at("excitation"));
  for (const json& one : stored.at("per_experiment"))
    e.per_experiment.push_back({one.at(0).get<std::string>(), optional_number(one.at(1)),
                                one.size() > 2 ? optional_number(one.at(2)) : std::nullopt,  // an older tab has two
                                one.size() > 3 ? one.at(3).get<std::string>() : std::string()});
  return e;
}

json stored_step_json(const Step& step) {
  json estimates = json::array();
  for (const estimation::Estimate& e : step.estimates) estimates.push_back(stored_estimate_json(e));
  return {{"action", step.action},
          {"what", step.what},
          {"model_text", step.model_text},
          {"files", step.files.string()},
          {"warnings", step.warnings},
          {"estimates", std::move(estimates)},
          {"project", step.project.string()},
          {"data_name", step.data_name},
          {"dataset_text", step.dataset_text},
          {"tolerated", step.tolerated}};
}

StoredStep step_of(const std::string& id, const json& stored) {
  StoredStep step;
  step.id = id;
  step.action = stored.at("action");
  step.what = stored.at("what");
  step.model_text = stored.at("model_text");
  step.files = stored.at("files").get<std::string>();
  step.warnings = stored.at("warnings").get<std::vector<std::string>>();
  step.project = stored.at("project").get<std::string>();
  step.data_name = stored.at("data_name");
  step.dataset_text = stored.at("dataset_text");
  step.tolerated = stored.at("tolerated").get<std::vector<std::string>>();
  for (const json& e : stored.at("estimates")) step.estimates.push_back(estimate_of(e));
  return step;
}

}  // namespace

void store_tabs(const std::filesystem::path& file, const std::list<std::shared_ptr<Session>>& tabs) {
  json steps = json::object(), listed = json::array();
  for (const auto& tab : tabs) {
    const History<std::shared_ptr<Step>> history = tab->history();
    json ids = json::array();
    for (std::size_t k = 0; k < history.size(); ++k) {
      if (!history[k]) continue;  // there is no model yet
      ids.push_back(history[k]->id);
      if ((k > 0 || !history[k]->project.empty()) && !steps.contains(history[k]->id))
        steps[history[k]->id] = stored_step_json(*history[k]);
    }
    listed.push_back({{"id", tab->id()},
                      {"changes", tab->wait(0, std::chrono::milliseconds(0))},
                      {"at", history.at()},
                      {"steps", std::move(ids)}});
  }
  const std::filesystem::path part = file.string() + ".part";
  {
    std::ofstream out(part, std::ios::binary);
    out << json{{"tabs", std::move(listed)}, {"steps", std::move(steps)}}.dump(-1, ' ', false,
                                                                               json::error_handler_t::replace);
    if (!out.flush()) throw std::runtime_error(fmt::format("{} cannot be written: is the disk full?", part.string()));
  }
  std::filesystem::rename(part, file);
}

std::list<std::shared_ptr<Session>> load_tabs(const std::filesystem::path& file, const std::shared_ptr<Step>& first,
                                              const estimation::PipelineOptions& pipeline, JobTable* jobs,
                                              const JobLimits& limits) {
  std::list<std::shared_ptr<Session>> tabs;
  std::ifstream in(file, std::ios::binary);
  if (!in) return tabs;
  const json stored = json::parse(in, nullptr, false);
  if (stored.is_discarded()) return tabs;
  std::map<std::string, std::shared_ptr<Step>> known;
  for (const json& one : stored.at("tabs")) {
    auto tab = std::make_shared<Session>(one.at("id").get<std::string>(), first, jobs, limits);
    const std::uint64_t changes = one.at("changes").get<std::uint64_t>() + kMoreChanges;
    History<std::shared_ptr<Step>> history(first);
    try {
      const auto ids = one.at("steps").get<std::vector<std::string>>();
      for (std::size_t k = first ? 1 : 0; k < ids.size(); ++k) {
        std::shared_ptr<Step>& step = known[ids[k]];
        if (!step)
          step = restored_step(step_of(ids[k], stored.at("steps").at(ids[k])), history.current().get(), pipeline);
        if (k == 0)
          history = History<std::shared_ptr<Step>>(step);
        else
          history.take(step);
      }
      history.go(one.at("at").get<std::size_t>());
      tab->restore(std::move(history), changes);
    } catch (const std::exception& error) {
      tab->restore(History<std::shared_ptr<Step>>(first), changes);
      tab->set_problem("", fmt::format("the steps of this tab could not be restored: {}", error.what()));
    }
    tabs.push_back(std::move(tab));
  }
  return tabs;
}

}  // namespace flexspline::workbench
