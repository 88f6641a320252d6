// What flexspline workbench takes.
#pragma once

#include <filesystem>
#include <string>

#include "host/cli/inputs.hpp"

namespace flexspline::cli {

struct WorkbenchOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::string drive;            // empty: none yet
  std::filesystem::path plant;  // for closed loops; empty: the twin that recorded the data, or the model
  int port = 0;                 // zero: any that is free
  double seconds = 0.0;         // zero: until Ctrl-C
  bool no_open = false;
  std::string json;
};
int run(const WorkbenchOptions& options, Console& console);

}  // namespace flexspline::cli
