// What the option --report does, for every command that has it.
#pragma once

#include <filesystem>

#include "host/cli/inputs.hpp"
#include "host/report/document.hpp"

namespace flexspline::cli {

// Said before the work and not after it. Throws UsageError; nothing is asked where no report is.
void require_report_place(const std::filesystem::path& file);

// Writes the page and says where it is; nothing where no report is asked.
void write_report(const std::filesystem::path& file, const report::Subject& subject, Console& console);

}  // namespace flexspline::cli
