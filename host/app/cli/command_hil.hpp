// A drive in closed loop, for hil and for the demo.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/app/cli/inputs.hpp"
#include "host/app/closed_loop/page.hpp"

namespace flexspline::cli {

struct HilOptions {
  std::string scenario;
  std::filesystem::path model;  // empty: the data of the drive's manufacturer
  std::filesystem::path base;   // model without the effect that was added; empty: no such run
  std::filesystem::path plant;
  std::filesystem::path settings;
  std::filesystem::path processor;
  std::filesystem::path report;
  std::filesystem::path picture;
  std::vector<std::string> with;
  std::string hide;
  double seconds = 0.0;
  std::uint64_t seed = 1;
  std::uint32_t tick_hz = closed_loop::kTwinTickHz;
  int draws = 8;  // of the prediction; zero: none
  std::string json;
};
// All runs, printed on the console and written to the files that the options name.
closed_loop::Comparison run_closed_loop(const HilOptions& options, Console& console);

}  // namespace flexspline::cli
