// Rows of the page that ./dev bench ends with. Each program appends its own to the file that FLEXSPLINE_BENCH_ROWS
// names: what | peer | goal | measured, a goal being "at least 8" or "at most 2.5", or "-". bench.sh says which are
// met.
#pragma once

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <string>

namespace flexspline::bench {

inline void row(const std::string& what, const std::string& peer, const std::string& goal, double measured) {
  if (const char* file = std::getenv("FLEXSPLINE_BENCH_ROWS"))
    std::ofstream(file, std::ios::app) << fmt::format("{} | {} | {} | {:.3g}\n", what, peer, goal, measured);
}

}  // namespace flexspline::bench
