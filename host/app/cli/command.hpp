// A command: its help, its options and what runs it. command_NAME.cpp makes it, command_list.inc lists all of them.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/app/cli/inputs.hpp"
#include "host/app/cli/parser.hpp"

namespace flexspline::cli {

struct CommandHelp {
  std::string_view name;
  std::string_view summary;      // a line in the list of commands
  std::string_view description;  // paragraphs
  // Lines to type one after the other in an empty folder; the last one is the command itself. A test runs them.
  std::vector<std::string_view> examples;
};

// A simulated drive, one of whose effects its base model lacks: data that every example can use.
inline constexpr std::string_view kMakeData = "flexspline-hil record --out demo-out --hide viscous_asymmetry";
inline constexpr std::string_view kIdentify =
    "flexspline identify demo-out --model demo-out/base-model.toml --out fitted.toml";

// A command whose options are declared: they are read when it runs.
struct DeclaredCommand {
  std::function<int(Console&)> run;
  std::shared_ptr<const std::string> json;  // file for the answer; empty: none
};

struct Command {
  CommandHelp help;
  std::function<DeclaredCommand(Parser&)> declare;
};

// `Options` has a member `json` in addition to what `declare` takes.
template <class Options>
Command command(CommandHelp help, void (*declare)(Parser&, Options&), int (*run)(const Options&, Console&)) {
  return {std::move(help), [declare, run](Parser& parser) {
            auto options = std::make_shared<Options>();
            parser.option("--json", options->json, "write the answer as JSON into this file; - is standard output")
                .value("FILE");
            declare(parser, *options);
            return DeclaredCommand{[options, run](Console& console) { return run(*options, console); },
                                   std::shared_ptr<const std::string>(options, &options->json)};
          }};
}

}  // namespace flexspline::cli
