// The command line as it was typed, brought into the form that the parser takes.
#pragma once

#include <string>
#include <vector>

namespace flexspline::cli {

// Without the program's name. `help` and `help COMMAND` become --help, and of `--tolerate a b` every kind of finding
// follows a --tolerate of its own: what comes behind may be DATA.
std::vector<std::string> arguments_from(int argc, char** argv);

// "--modle is not known; did you mean --model?" of the first option in `arguments` that is not among `known`; empty
// where there is none, or nothing is like it.
std::string misspelt_option(const std::vector<std::string>& arguments, const std::vector<std::string>& known);

}  // namespace flexspline::cli
