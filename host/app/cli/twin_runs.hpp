// Closed loops on the twin, each in a process of its own, as many at a time as there are cores.
#pragma once

#include <filesystem>
#include <string>

#include "host/app/closed_loop/runs.hpp"

namespace flexspline::cli {

closed_loop::Runner twin_runner();
// The manufacturer's data of the drive of a job, written into `folder` by the twin (settings.toml, known-model.toml
// and, with a hidden effect, whole-model.toml).
void fetch_data_sheet(const closed_loop::Job& job, const std::filesystem::path& folder);

}  // namespace flexspline::cli
