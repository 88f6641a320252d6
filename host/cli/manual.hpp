// Shell completion and the man page, from the same options and texts that --help is made of.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/cli/inputs.hpp"
#include "host/cli/option_tree.hpp"

namespace flexspline::cli {

struct CompletionOptions {
  std::string shell;
  std::string json;
  OptionTree tree;
};
int run(const CompletionOptions& options, Console& console);

struct ManOptions {
  std::string json;
  OptionTree tree;
};
int run(const ManOptions& options, Console& console);

// A script for bash, zsh or fish, to be read by the shell at its start. `effects` are offered where one is named.
std::string completion_script(std::string_view shell, const std::vector<CommandText>& commands,
                              const std::vector<std::string>& effects);
// A page of section 1 in the macros of man(7).
std::string man_page(const std::vector<CommandText>& commands);

// The options that both commands have in addition to --json.
template <class Parser>
void take_manual(Parser* completion, CompletionOptions& options) {
  completion->add_option("SHELL", options.shell, "bash, zsh or fish")->required()->type_name("{bash,zsh,fish}");
}

}  // namespace flexspline::cli
