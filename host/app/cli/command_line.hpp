// The command line: how it is parsed, how errors become messages and exit codes.
#pragma once

#include <string>
#include <vector>

#include "host/app/cli/command.hpp"

namespace flexspline::cli {

// Parses and runs one of `commands`. Exit codes as in app.hpp.
int run(const std::vector<Command>& commands, int argc, char** argv);

}  // namespace flexspline::cli
