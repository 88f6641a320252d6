#include "host/app/workbench/work.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/app/workbench/access_control.hpp"
#include "host/engine/comparison/compare.hpp"
#include "host/engine/selection/add.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/report/page.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;

// Facts of the drive that only the data set has are not written into the model file.
std::string rewritten(const std::string& text, const model::Model& changed) {
  const model::ModelFile file = model::parse(text, "the model", catalogue::known_effects());
  model::Model stored = changed;
  stored.drive = file.model.drive;
  return model::rewrite(file, stored);
}

std::shared_ptr<Step> made(std::string action, std::string what, std::shared_ptr<const data::Dataset> dataset,
                           const model::Model& model, const std::string& text_before,
                           std::vector<estimation::Estimate> estimates, std::vector<std::string> warnings,
                           const estimation::PipelineOptions& pipeline, const Progress& progress) {
  progress("comparing with the measurement");
  auto step = std::make_shared<Step>();
  step->id = new_token();
  step->action = std::move(action);
  step->what = std::move(what);
  step->dataset = std::move(dataset);
  step->model = model;
  step->model_text = rewritten(text_before, model);
  step->estimates = std::move(estimates);
  step->warnings = std::move(warnings);
  step->pipeline = pipeline;
  step->errors = std::make_unique<const json>(step->view()->errors());
  progress("");  // a last chance to cancel
  return step;
}

bool has_values(const model::Model& model) {
  return std::all_of(model.effects.begin(), model.effects.end(),
                     [](const model::Effect& e) { return catalogue::missing_values(e).empty(); });
}

// The records of a data set, made once for all its steps: a fit, a comparison and a search begin with them.
estimation::PipelineOptions with_records(const std::shared_ptr<const data::Dataset>& dataset, const model::Model& model,
                                         estimation::PipelineOptions pipeline, const Progress& progress) {
  struct StoredCurves {
    std::shared_ptr<const data::Dataset> dataset;  // records point into it
    estimation::PreparedData records;
  };
  progress("filtering the measurements");
  std::vector<std::string> warned_by_fit;
  pipeline.ready = nullptr;
  model::Model reconciled = model;
  reconciled.drive = estimation::reconcile(model.drive, *dataset, warned_by_fit);
  const auto stored = std::make_shared<const StoredCurves>(
      StoredCurves{dataset, estimation::prepare_all(*dataset, reconciled, pipeline)});
  pipeline.ready = {stored, &stored->records};
  return pipeline;
}

// Those of the step before, whose data are the same.
estimation::PipelineOptions as_before(const Step& before, estimation::PipelineOptions pipeline) {
  pipeline.ready = before.pipeline.ready;
  return pipeline;
}

std::shared_ptr<Step> identified(std::string action, std::string what, std::shared_ptr<const data::Dataset> dataset,
                                 const model::Model& model, const std::string& text,
                                 const estimation::PipelineOptions& pipeline, const Progress& progress) {
  progress("identifying the model");
  const auto found = estimation::identify(*dataset, model, pipeline);
  return made(std::move(action), std::move(what), std::move(dataset), found->model, text, found->estimates,
              found->warnings, pipeline, progress);
}

std::shared_ptr<Step> of_change(std::string action, const std::string& what, const Step& before,
                                const selection::Addition& change, const estimation::PipelineOptions& pipeline,
                                const Progress& progress) {
  return made(std::move(action), what, before.dataset, change.model, before.model_text, change.estimates,
              change.warnings, pipeline, progress);
}

// How dropped files are read: by a dataset.toml for them, else each by its own format.
std::vector<std::filesystem::path> recordings_of(const std::filesystem::path& folder) {
  if (std::filesystem::exists(folder / "dataset.toml")) return {folder / "dataset.toml"};
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

// The data of a step and those of the files in `folder`, and the names of these.
std::pair<std::shared_ptr<const data::Dataset>, std::string> joined(const data::Dataset& before,
                                                                    const std::filesystem::path& folder,
                                                                    const std::vector<std::string>& tolerated) {
  data::Dataset more = data::load(recordings_of(folder), {tolerated, false, before.drive.axis});
  auto all = std::make_shared<data::Dataset>(before);
  data::merge_facts(all->drive, more.drive,
                    {"the data that are open", "these files", "drop measurements of the same drive"});
  std::string names;
  for (data::Experiment& e : more.experiments) {
    const std::string name = e.name;
    const auto taken = [&] {
      return std::any_of(all->experiments.begin(), all->experiments.end(),
                         [&](const auto& x) { return x.name == e.name; });
    };
    for (int number = 2; taken(); ++number) e.name = fmt::format("{}-{}", name, number);
    names += (names.empty() ? "" : ", ") + e.name;
    all->experiments.push_back(std::move(e));
  }
  for (data::Finding& finding : more.findings) {
    finding.file = std::filesystem::path(finding.file).filename().string();
    all->findings.push_back(std::move(finding));
  }
  return {all, names};
}

}  // namespace

std::shared_ptr<Step> open(std::shared_ptr<const data::Dataset> dataset, const model::ModelFile& file,
                           const estimation::PipelineOptions& pipeline, const Progress& progress) {
  const estimation::PipelineOptions own = with_records(dataset, file.model, pipeline, progress);
  if (!has_values(file.model)) return identified("open", "", dataset, file.model, file.text, own, progress);
  return made("open", "", std::move(dataset), file.model, file.text, {}, {}, own, progress);
}

std::shared_ptr<Step> with_effect(const Step& before, const std::string& effect,
                                  const estimation::PipelineOptions& pipeline, const Progress& progress) {
  progress(fmt::format("adding {} and refitting", effect));
  const estimation::PipelineOptions own = as_before(before, pipeline);
  return of_change("add", effect, before, selection::add(*before.dataset, before.model, effect, own), own, progress);
}

std::shared_ptr<Step> without_effect(const Step& before, const std::string& id,
                                     const estimation::PipelineOptions& pipeline, const Progress& progress) {
  progress(fmt::format("taking {} out and refitting", id));
  const estimation::PipelineOptions own = as_before(before, pipeline);
  return of_change("remove", id, before, selection::remove(*before.dataset, before.model, id, own), own, progress);
}

std::shared_ptr<Step> refitted(const Step& before, const estimation::PipelineOptions& pipeline,
                               const Progress& progress) {
  return identified("identify", "", before.dataset, before.model, before.model_text, as_before(before, pipeline),
                    progress);
}

std::shared_ptr<Step> with_files(const Step& before, const std::filesystem::path& folder,
                                 const std::vector<std::string>& tolerated, const estimation::PipelineOptions& pipeline,
                                 const Progress& progress) {
  progress("reading the files");
  const auto [all, names] = joined(*before.dataset, folder, tolerated);
  auto step = identified("data", names, all, before.model, before.model_text,
                         with_records(all, before.model, pipeline, progress), progress);
  step->files = folder;
  step->tolerated = tolerated;
  return step;
}

std::shared_ptr<Step> first_of(const Project& project, const std::filesystem::path& folder,
                               const estimation::PipelineOptions& pipeline, const Progress& progress) {
  const model::ModelFile file = model::parse(project.model_text, "the first model", catalogue::known_effects());
  auto step = open(project.dataset, file, pipeline, progress);
  step->project = folder;
  step->dataset_text = project.dataset_text;
  return step;
}

std::shared_ptr<Step> restored_step(const StoredStep& stored, const Step* before,
                                    const estimation::PipelineOptions& pipeline) {
  const Progress progress = [](std::string_view) {};
  const model::Model model = model::parse(stored.model_text, "the model", catalogue::known_effects()).model;
  std::shared_ptr<const data::Dataset> dataset;
  estimation::PipelineOptions own = pipeline;
  if (before == nullptr || !stored.files.empty()) {
    dataset = before == nullptr ? std::make_shared<const data::Dataset>(
                                      data::load({stored.project / "dataset.toml"}, {stored.tolerated, false}))
                                : joined(*before->dataset, stored.files, stored.tolerated).first;
    own = with_records(dataset, model, pipeline, progress);
  } else {
    dataset = before->dataset;
    own = as_before(*before, pipeline);
  }
  auto step = made(stored.action, stored.what, dataset, model, stored.model_text, stored.estimates, stored.warnings,
                   own, progress);
  step->id = stored.id;
  step->files = stored.files;
  step->project = stored.project;
  step->data_name = stored.data_name;
  step->dataset_text = stored.dataset_text;
  step->tolerated = stored.tolerated;
  return step;
}

std::string model_file(const Step& step) {
  return step.model_text;
}

std::string report_page(const Step& step, const Step* before, const std::string& data_name,
                        const estimation::PipelineOptions& pipeline) {
  report::Subject subject;
  subject.command = "workbench";
  subject.data_name = data_name;
  subject.model_name = step.model.name;
  subject.dataset = step.dataset.get();
  subject.model = step.model;
  subject.pipeline = as_before(step, pipeline);
  subject.estimates = step.estimates;
  if (before && before->dataset == step.dataset) subject.before = before->model;
  if (before && before->diagnosed() && step.action == "add") subject.rounds.push_back(*before->diagnosed());
  if (const auto found = step.diagnosed()) subject.rounds.push_back(*found);
  return report::page(report::document(subject));
}

json pack_json(const deployment::Packed& packed) {
  return {{"bytes", packed.bytes.size()},
          {"sha256", packed.sha256},
          {"max_error_nm", output::json_number(packed.max_error_nm)},
          {"max_error_share_of_rated", output::json_number(packed.max_error_share_of_rated)},
          {"worst_balance", packed.worst_balance},
          {"bounds", packed.proof.size()}};
}

}  // namespace flexspline::workbench
