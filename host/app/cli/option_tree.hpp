// The commands with their options as plain data, taken from the parser that reads them: --help, completion and the man
// page cannot differ.
#pragma once

#include <string>
#include <vector>

#include "host/app/cli/command.hpp"

namespace flexspline::cli {

struct OptionText {
  enum class Takes { nothing, words, files, choice, effect };
  std::string name;   // "--out"; without dashes its place identifies it
  std::string value;  // the placeholder of the value: "FILE"; empty where the choices are listed
  std::vector<std::string> choices;
  std::string help;
  std::string usual;  // default; empty: none, or said in `help`
  Takes takes = Takes::words;
  bool required = false;
  bool is_positional() const { return !name.starts_with("-"); }
};

struct CommandText {
  CommandHelp help;
  std::vector<OptionText> options;
};

std::vector<CommandText> option_tree(const std::vector<Command>& commands);

}  // namespace flexspline::cli
