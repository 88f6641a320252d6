// What monitor shows: live signals, or the residual map.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/app/cli/inputs.hpp"

namespace flexspline::cli {

struct MonitorOptions {
  std::string drive;
  double seconds = 0.0;  // zero: until Ctrl-C
  double rate_hz = 10.0;
  std::vector<std::string> channels;
  bool residual_map = false;  // that, and not the signals
  bool reset = false;
  std::filesystem::path pairing_key;  // empty: none
  std::optional<double> limit_nm;
  std::string json;
};
int run_residual_map(const MonitorOptions& options, Console& console);

}  // namespace flexspline::cli
