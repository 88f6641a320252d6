// What `new` writes if it cannot finish: the draft with what could be found, and the command to continue with.
#pragma once

#include <exception>
#include <filesystem>
#include <string>

#include "host/app/cli/inputs.hpp"
#include "host/app/project/draft.hpp"

namespace flexspline::cli {

// Whether a dataset.toml is such a draft that nobody has changed since, which may be written over.
bool is_unfinished(const std::filesystem::path& dataset_toml);

// Writes the draft as OUT/dataset.toml, in which the lines of `why`'s findings are right, and reports what is missing.
void leave_unfinished(const project::Draft& draft, const project::Request& request, const std::exception& why,
                      Console& console);

}  // namespace flexspline::cli
