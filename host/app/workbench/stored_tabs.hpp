// Stores the tabs in a file, from which the next worker process restores them.
#pragma once

#include <filesystem>
#include <list>
#include <memory>

#include "host/app/workbench/session.hpp"

namespace flexspline::workbench {

// Throws std::runtime_error where it cannot be written.
void store_tabs(const std::filesystem::path& file, const std::list<std::shared_ptr<Session>>& tabs);

// Loads the stored tabs with their steps, without their diagnoses; none where there is no such file. `first` is the
// first step of all. A tab whose steps cannot be restored starts from the first step, with a message.
std::list<std::shared_ptr<Session>> load_tabs(const std::filesystem::path& file, const std::shared_ptr<Step>& first,
                                              const estimation::PipelineOptions& pipeline, JobTable* jobs,
                                              const JobLimits& limits);

}  // namespace flexspline::workbench
