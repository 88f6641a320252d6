// The command line: which commands there are, how it is run.
#pragma once

#include <vector>

#include "host/app/cli/command.hpp"

namespace flexspline::cli {

// All commands, in the order of --help.
std::vector<Command> all_commands();

// Runs one command. 0: it did its work, whatever the verdict; 1: a limit that the user gave was not met; 2: unusable
// input or arguments, reported on standard error as "flexspline COMMAND: what; what to do".
int run(int argc, char** argv);

}  // namespace flexspline::cli
