// The text of --help for each command, and its examples, which a test runs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flexspline::cli {

struct CommandHelp {
  std::string_view name;
  std::string_view summary;      // a line in the list of commands
  std::string_view description;  // paragraphs
  // Lines to type one after the other in an empty folder; the last one is the command itself.
  std::vector<std::string_view> examples;
};

const CommandHelp& help_of(std::string_view command);

// "Example:" and the lines of `examples`.
std::string example_text(const CommandHelp& help);

}  // namespace flexspline::cli
