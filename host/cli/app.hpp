// The command line: which commands there are, what they take, how errors become messages and exit codes.
#pragma once

namespace flexspline::cli {

// Runs one command. 0: it did its work, whatever the verdict; 1: a limit that the user gave was not met; 2: unusable
// input or arguments, reported on standard error as "flexspline COMMAND: what; what to do".
int run(int argc, char** argv);

}  // namespace flexspline::cli
