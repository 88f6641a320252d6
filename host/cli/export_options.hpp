// export: of a model, or of what every drive speaks.
#pragma once

#include "host/cli/commands.hpp"

namespace flexspline::cli {

struct ExportCommandOptions : ExportOptions {
  bool protocol_header = false;  // then without a model
};
int run(const ExportCommandOptions& options, Console& console);

}  // namespace flexspline::cli
