#include "host/app/cli/report_option.hpp"

#include <fmt/format.h>

namespace flexspline::cli {

void require_report_place(const std::filesystem::path& file) {
  if (!file.empty()) report::require_place(file);
}

void write_report(const std::filesystem::path& file, const report::Subject& subject, Console& console) {
  if (file.empty()) return;
  console.progress("writing the report");
  report::write(file, subject);
  console.line();
  console.line(fmt::format("{} shows this with plots; open it in a browser.", file.string()));
}

}  // namespace flexspline::cli
