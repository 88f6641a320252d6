#include "host/app/cli/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <regex>
#include <string_view>
#include <utility>

#include "host/app/cli/arguments.hpp"
#include "host/app/cli/help_format.hpp"
#include "host/app/cli/option_tree.hpp"
#include "host/common/text/build_identity.hpp"
#include "host/common/text/nearest.hpp"
#include "host/input/data/findings.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

// CLI11's own checks of a sign print the range of a double.
CLI::Validator sign_check(bool zero_is_allowed) {
  const std::string name = zero_is_allowed ? "NONNEGATIVE" : "POSITIVE";
  return CLI::Validator(
      [zero_is_allowed](const std::string& text) {
        double value = 0.0;
        const bool good = CLI::detail::lexical_cast(text, value) && (value > 0.0 || (zero_is_allowed && value == 0.0));
        if (good) return std::string();
        const bool has_comma = text.find(',') != std::string::npos;
        return fmt::format("\"{}\" is not a number {}{}", text, zero_is_allowed ? "from zero on" : "above zero",
                           has_comma ? "; write it without a comma, as 1000 or 0.05" : "");
      },
      name);
}

// "--separate: At least 2 required but received 1": says nothing of how values are separated. "Could not convert:
// --cutoff-hz = 5kHz": nothing of what it takes.
std::string in_words(const std::string& error) {
  static const std::regex too_few("(.*): At least ([0-9]+) required but received ([0-9]+)");
  static const std::regex no_number("Could not convert: (.*) = (.*)");
  std::smatch part;
  if (std::regex_match(error, part, no_number)) {
    double value = 0.0;
    const bool is_number = CLI::detail::lexical_cast(part.str(2), value);
    return fmt::format("{} takes a {} without a unit, and \"{}\" was given", part.str(1),
                       is_number ? "whole number" : "number", part.str(2));
  }
  if (!std::regex_match(error, part, too_few)) return error;
  return fmt::format("{} takes {} values with a comma between them, and {} {} given", part.str(1), part.str(2),
                     part.str(3), part.str(3) == "1" ? "was" : "were");
}

// Commands by words that other tools have for them.
std::string other_word_for(const std::string& word) {
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"explain", "effects"},  {"list", "effects"},     {"fit", "identify"},    {"estimate", "identify"},
      {"validate", "compare"}, {"evaluate", "compare"}, {"plot", "compare"},    {"residuals", "compare"},
      {"analyse", "diagnose"}, {"analyze", "diagnose"}, {"convert", "measure"}, {"init", "new"},
      {"quantise", "pack"},    {"quantize", "pack"},    {"upload", "flash"},    {"run", "hil"},
      {"ui", "workbench"},     {"gui", "workbench"}};
  const auto found = std::ranges::find(kWords, std::string_view(word), [](const auto& pair) { return pair.first; });
  return found == std::end(kWords) ? std::string() : std::string(found->second);
}

}  // namespace

Option& Option::required() {
  option_->required();
  return *this;
}
Option& Option::value(std::string_view placeholder) {
  option_->type_name(std::string(placeholder));
  return *this;
}
Option& Option::shows_default() {
  option_->capture_default_str();
  return *this;
}
Option& Option::comma_separated() {
  option_->delimiter(',');
  return *this;
}
Option& Option::one_value_each_time() {
  option_->allow_extra_args(false);
  return *this;
}
Option& Option::number_of_values(int count) {
  option_->expected(count);
  return *this;
}
Option& Option::positive() {
  option_->check(sign_check(false));
  return *this;
}
Option& Option::not_negative() {
  option_->check(sign_check(true));
  return *this;
}
Option& Option::existing_file() {
  option_->check(CLI::ExistingFile);
  return *this;
}
Option& Option::within(int low, int high) {
  option_->check(CLI::Range(low, high));
  return *this;
}
Option& Option::within(double low, double high) {
  option_->check(CLI::Range(low, high));
  return *this;
}
Option& Option::one_of(const std::vector<std::string>& choices) {
  option_->check(CLI::IsMember(choices));
  return *this;
}
Option& Option::one_of_numbers(const std::vector<int>& choices) {
  option_->check(CLI::IsMember(choices));
  return *this;
}
Option& Option::excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}
Option& Option::needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

template <class Value>
Option Parser::option(const char* name, Value& value, const std::string& help) {
  return Option(parser_.add_option(name, value, help));
}
Option Parser::flag(const char* name, bool& value, const std::string& help) {
  return Option(parser_.add_flag(name, value, help));
}

template Option Parser::option(const char*, std::string&, const std::string&);
template Option Parser::option(const char*, std::filesystem::path&, const std::string&);
template Option Parser::option(const char*, int&, const std::string&);
template Option Parser::option(const char*, std::uint16_t&, const std::string&);
template Option Parser::option(const char*, std::uint32_t&, const std::string&);
template Option Parser::option(const char*, std::uint64_t&, const std::string&);
template Option Parser::option(const char*, double&, const std::string&);
template Option Parser::option(const char*, std::optional<int>&, const std::string&);
template Option Parser::option(const char*, std::optional<std::uint16_t>&, const std::string&);
template Option Parser::option(const char*, std::optional<std::uint64_t>&, const std::string&);
template Option Parser::option(const char*, std::optional<double>&, const std::string&);
template Option Parser::option(const char*, std::vector<std::string>&, const std::string&);
template Option Parser::option(const char*, std::vector<std::filesystem::path>&, const std::string&);
template Option Parser::option(const char*, std::vector<double>&, const std::string&);

namespace {

std::string example_text(const CommandHelp& help) {
  std::string text = "Example:";
  for (const std::string_view line : help.examples) text += fmt::format("\n  {}", line);
  return text;
}

// The parser of one command, as a part of the whole one.
CLI::App* subcommand_of(CLI::App& app, const CommandHelp& help) {
  CLI::App* sub = app.add_subcommand(std::string(help.name), std::string(help.summary));
  sub->footer(output::wrapped(help.description, 0) + "\n\n" + example_text(help));
  return sub;
}

class CommandLine {
 public:
  explicit CommandLine(const std::vector<Command>& commands) {
    app_.name("flexspline");
    app_.description(output::wrapped(
        "Flexspline finds out which physical effects a drive with strain-wave gear has, and which its model lacks.",
        0));
    app_.formatter(std::make_shared<HelpFormat>());
    app_.require_subcommand(1);
    app_.set_version_flag("--version", text::tool_name(), "print version and build");
    for (const Command& command : commands) {
      CLI::App* sub = subcommand_of(app_, command.help);
      Parser parser(*sub);
      sub->callback([this, declared = command.declare(parser)] { chosen_ = declared; });
    }
    app_.footer(output::wrapped(
        "flexspline COMMAND --help explains each with an example. Exit codes: 0 done, 1 a limit that was "
        "given is not met, 2 unusable input or arguments.",
        0));
  }

  int run(int argc, char** argv) {
    const int code = parse_and_run(argc, argv);
    const std::string reason = output::unwritten();
    if (reason.empty() || code == kUnusable) return code;
    fmt::print(stderr,
               "flexspline: the answer could not be written to standard output: {}; make room, or redirect it\n",
               reason);
    return code == kDone ? kUnusable : code;
  }

 private:
  int parse_and_run(int argc, char** argv) {
    std::vector<std::string> arguments = arguments_from(argc, argv);
    const std::string command = arguments.empty() ? "" : arguments[0];
    if (const std::string problem = wrong_command(command); !problem.empty()) {
      fmt::print(stderr, "flexspline: {}\n", problem);
      return kUnusable;
    }
    try {
      app_.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // which takes the last one first
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() == 0) return app_.exit(error);
      const std::string misspelt = misspelt_option(arguments, options_of(command));
      fmt::print(stderr, "flexspline {}: {}; flexspline {} --help shows what it takes\n", command,
                 misspelt.empty() ? in_words(error.what()) : misspelt, command);
      return kUnusable;
    }
    return run_chosen(command);
  }

  std::string wrong_command(const std::string& command) const {
    if (command.empty()) return "no command was given; flexspline --help lists them";
    if (command.starts_with("-")) return {};
    std::vector<std::string> names;
    for (const CLI::App* sub : app_.get_subcommands([](const CLI::App*) { return true; }))
      names.push_back(sub->get_name());
    if (std::find(names.begin(), names.end(), command) != names.end()) return {};
    const std::vector<std::string_view> known(names.begin(), names.end());
    std::string near = other_word_for(command);
    if (near.empty()) near = text::nearest(command, known);
    return fmt::format(
        "there is no command \"{}\"; {}", command,
        near.empty() ? std::string("flexspline --help lists them") : fmt::format("did you mean {}?", near));
  }

  std::vector<std::string> options_of(const std::string& command) const {
    std::vector<std::string> names;
    for (const CLI::App* sub : app_.get_subcommands([&](const CLI::App* one) { return one->get_name() == command; }))
      for (const CLI::Option* option : sub->get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    return names;
  }

  int run_chosen(const std::string& command) {
    Console console(command, *chosen_.json == "-");
    try {
      return chosen_.run(console);
    } catch (const data::DataError& error) {
      for (const data::Finding& finding : error.findings())
        if (finding.severity == data::Severity::error) console.error(finding.text());
    } catch (const std::exception& error) {
      console.error(error.what());
    }
    return kUnusable;
  }

  CLI::App app_;
  DeclaredCommand chosen_;
};

// From "NAME:{one,two}", as the parser describes a value with its checks.
std::vector<std::string> choices_of(const std::string& type) {
  std::vector<std::string> choices;
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos || close < open) return choices;
  for (std::size_t at = open + 1; at < close;) {
    const std::size_t end = std::min(type.find(',', at), close);
    choices.push_back(type.substr(at, end - at));
    at = end + 1;
  }
  return choices;
}
bool names_files(std::string_view value) {
  constexpr std::string_view kFiles[] = {"FILE", "FILE.toml", "PATH",  "DIR",   "MODEL", "OUT",     "BLOCK",
                                         "PLAN", "DATA",      "IMAGE", "TASKS", "PLANT", "RESULTS", "FOLDER"};
  return std::find(std::begin(kFiles), std::end(kFiles), value) != std::end(kFiles);
}

OptionText::Takes what_it_takes(const CLI::Option& option, const OptionText& text) {
  const std::string& kind = text.is_positional() ? text.name : text.value;
  if (option.get_items_expected_max() == 0) return OptionText::Takes::nothing;
  if (!text.choices.empty()) return OptionText::Takes::choice;
  if (kind == "EFFECT" || (text.is_positional() && kind == "NAME")) return OptionText::Takes::effect;
  return names_files(kind) ? OptionText::Takes::files : OptionText::Takes::words;
}

OptionText text_of(const CLI::Option& option) {
  OptionText text;
  text.name = option.get_positional() ? option.get_name(true) : "--" + option.get_lnames().front();
  const std::string type = option.get_type_name();
  text.value = type.substr(0, type.find_first_of(":{"));
  text.choices = choices_of(type);
  text.help = option.get_description();
  text.usual = option.get_default_str();
  text.required = option.get_required();
  text.takes = what_it_takes(option, text);
  return text;
}

}  // namespace

std::vector<CommandText> option_tree(const std::vector<Command>& commands) {
  CLI::App app;
  std::vector<CommandText> tree;
  for (const Command& command : commands) {
    CLI::App* sub = subcommand_of(app, command.help);
    Parser parser(*sub);
    command.declare(parser);
    CommandText text{command.help, {}};
    for (const CLI::Option* option : sub->get_options()) text.options.push_back(text_of(*option));
    tree.push_back(std::move(text));
  }
  return tree;
}

int run(const std::vector<Command>& commands, int argc, char** argv) {
  return CommandLine(commands).run(argc, argv);
}

}  // namespace flexspline::cli
