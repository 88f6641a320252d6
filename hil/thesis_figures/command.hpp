// `flexspline-hil report` and `flexspline-hil model`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace flexspline::thesis_figures {

struct ReportOptions {
  std::string what;  ///< the number of a figure, "all", or "list"
  std::string out;
  std::uint64_t seed = 7001;
};

/// Writes figure-NN.svg and figure-NN.csv, and figures.md with what the report says of each beside what ours measures,
/// and with what is not made and why. Throws std::invalid_argument for a number that is no figure or is not made.
void write_report(const ReportOptions& options);

/// The report's blocks: "motor", "saturation", "friction", "models", "all". Writes the same kinds of files.
void write_models(const ReportOptions& options);

}  // namespace flexspline::thesis_figures
