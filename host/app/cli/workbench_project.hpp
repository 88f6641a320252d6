// What the workbench begins with where there is no model yet: the functions of `flexspline new`.
#pragma once

#include <filesystem>

#include "host/app/workbench/project.hpp"

namespace flexspline::cli {

// `home`: the user's current folder; a dataset.toml for files that are not in the workbench's own folder names them
// from there.
workbench::Projects projects(const std::filesystem::path& home);

}  // namespace flexspline::cli
