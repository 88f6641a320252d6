// What the option --report does, for every command that has it.
#pragma once

#include <filesystem>

#include "host/app/cli/inputs.hpp"
#include "host/output/report/document.hpp"

namespace flexspline::cli {

// Checked before the work and not after it. Throws UsageError; nothing is checked where no report is requested.
void require_report_place(const std::filesystem::path& file);

// Writes the page and prints its path; nothing where no report is requested.
void write_report(const std::filesystem::path& file, const report::Subject& subject, Console& console);

}  // namespace flexspline::cli
