// The tabs in a file, from which the next worker process has them again where one ended.
#pragma once

#include <filesystem>
#include <list>
#include <memory>

#include "host/workbench/session.hpp"

namespace flexspline::workbench {

// Throws std::runtime_error where it cannot be written.
void keep_tabs(const std::filesystem::path& file, const std::list<std::shared_ptr<Session>>& tabs);

// As they were kept, with their steps but without what was found missing; none where there is no such file. `first` is
// the first step of all. A tab with steps that cannot be made again begins anew and says so.
std::list<std::shared_ptr<Session>> tabs_again(const std::filesystem::path& file, const std::shared_ptr<Step>& first,
                                               const estimation::PipelineOptions& pipeline, JobBoard* board,
                                               const JobLimits& limits);

}  // namespace flexspline::workbench
