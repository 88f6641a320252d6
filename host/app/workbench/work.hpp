// The work of the page: steps of a model, its files, blocks for a drive. The same functions as the commands.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "host/app/workbench/project.hpp"
#include "host/app/workbench/session.hpp"
#include "host/drive_link/deployment/pack.hpp"

namespace flexspline::workbench {

// The first step: the model of the file where it has all values, else identified. `text` is the file's.
std::shared_ptr<Step> open(std::shared_ptr<const data::Dataset> dataset, const model::ModelFile& file,
                           const estimation::PipelineOptions& pipeline, const Progress& progress);

// Steps from `before`; each throws what the function of the command throws.
std::shared_ptr<Step> with_effect(const Step& before, const std::string& effect,
                                  const estimation::PipelineOptions& pipeline, const Progress& progress);
std::shared_ptr<Step> without_effect(const Step& before, const std::string& id,
                                     const estimation::PipelineOptions& pipeline, const Progress& progress);
std::shared_ptr<Step> refitted(const Step& before, const estimation::PipelineOptions& pipeline,
                               const Progress& progress);
// `folder` holds nothing but the new files, maybe with a dataset.toml. They join the data; the model is identified
// again.
std::shared_ptr<Step> with_files(const Step& before, const std::filesystem::path& folder,
                                 const std::vector<std::string>& tolerated, const estimation::PipelineOptions& pipeline,
                                 const Progress& progress);
// The first step of a project whose dataset.toml is in `folder`.
std::shared_ptr<Step> first_of(const Project& project, const std::filesystem::path& folder,
                               const estimation::PipelineOptions& pipeline, const Progress& progress);

// A step of an earlier worker process, from its stored form; `before` is the one before it.
struct StoredStep {
  std::string id, action, what, model_text;
  std::filesystem::path files, project;
  std::string data_name, dataset_text;
  std::vector<std::string> tolerated;
  std::vector<estimation::Estimate> estimates;
  std::vector<std::string> warnings;
};
// `before` is null for the first step of a project.
std::shared_ptr<Step> restored_step(const StoredStep& stored, const Step* before,
                                    const estimation::PipelineOptions& pipeline);

// A model as it is written into files.
std::string model_file(const Step& step);
// The report page of a step, with what it was before where there is a step before.
std::string report_page(const Step& step, const Step* before, const std::string& data_name,
                        const estimation::PipelineOptions& pipeline);

// "flexspline-pack/1" without the parts of the proof, and how many these are.
nlohmann::json pack_json(const deployment::Packed& packed);

}  // namespace flexspline::workbench
