#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/app.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/option_tree.hpp"
#include "host/common/text/build_identity.hpp"
#include "host/output/answers/json.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::cli {
namespace {

using Takes = OptionText::Takes;

struct CompletionOptions {
  std::string shell;
  std::string json;
};

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}
std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}
// Within single quotes of bash and zsh.
std::string in_quotes(std::string_view text) {
  return replaced(std::string(text), "'", "'\\''");
}
// Up to the first stop: a list of options has room for a line each.
std::string brief(const std::string& help) {
  return help.substr(0, help.find_first_of(";("));
}

// What follows `option` on the line, as words of bash's `compgen`.
std::string bash_reply(const OptionText& option) {
  switch (option.takes) {
    case Takes::files:
      return "_flexspline_files";
    case Takes::effect:
      return "_flexspline_words \"$_flexspline_effects\"";
    case Takes::choice:
      return fmt::format("_flexspline_words '{}'", in_quotes(joined(option.choices)));
    default:
      return option.value == "DRIVE" ? "_flexspline_words twin" : ":";
  }
}

std::string bash(const std::vector<CommandText>& commands, const std::vector<std::string>& effects) {
  std::string names, values, options, places;
  for (const CommandText& command : commands) {
    names += fmt::format("{} ", command.help.name);
    std::string dashed;
    std::vector<const OptionText*> positional;
    for (const OptionText& option : command.options) {
      if (option.is_positional()) {
        positional.push_back(&option);
        continue;
      }
      dashed += option.name + " ";
      if (option.takes != Takes::nothing)
        values += fmt::format("    '{} {}') {}; return ;;\n", command.help.name, option.name, bash_reply(option));
    }
    options += fmt::format("      {}) _flexspline_words '{}' ;;\n", command.help.name, dashed);
    if (positional.empty()) continue;
    if (positional.size() > 1)
      places += fmt::format("    '{} 2') {} ;;\n", command.help.name, bash_reply(*positional.front()));
    places += fmt::format("    '{} '*) {} ;;\n", command.help.name, bash_reply(*positional.back()));
  }
  return fmt::format(R"(# Completion of flexspline for bash: source it, or put it into /etc/bash_completion.d.
# Made by {}.
_flexspline_effects='{}'
_flexspline_words() {{
  COMPREPLY=($(compgen -W "$1" -- "$current"))
}}
_flexspline_files() {{
  local IFS=$'\n'
  COMPREPLY=($(compgen -f -- "$current"))
  compopt -o filenames 2>/dev/null || :
}}
_flexspline() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}} command=${{COMP_WORDS[1]}}
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    _flexspline_words '{}--help --version'
    return
  fi
  case "$command $previous" in
{}  esac
  if [[ $current == -* ]]; then
    case $command in
{}    esac
    return
  fi
  case "$command $COMP_CWORD" in
{}  esac
}}
complete -F _flexspline flexspline
)",
                     text::tool_name(), joined(effects), names, values, options, places);
}

std::string zsh_text(std::string_view text) {
  std::string escaped;
  for (const char c : in_quotes(text)) {
    if (c == '[' || c == ']' || c == ':') escaped += '\\';
    escaped += c;
  }
  return escaped;
}
std::string zsh_value(const OptionText& option) {
  const std::string what = option.value.empty() ? (option.is_positional() ? option.name : "value") : option.value;
  switch (option.takes) {
    case Takes::nothing:
      return {};
    case Takes::files:
      return fmt::format(":{}:_files", zsh_text(what));
    case Takes::effect:
      return fmt::format(":{}:($effects)", zsh_text(what));
    case Takes::choice:
      return fmt::format(":{}:({})", zsh_text(what), joined(option.choices));
    case Takes::words:
      break;
  }
  return fmt::format(":{}:{}", zsh_text(what), option.value == "DRIVE" ? "(twin)" : " ");
}

std::string zsh(const std::vector<CommandText>& commands, const std::vector<std::string>& effects) {
  std::string names, cases;
  for (const CommandText& command : commands) {
    names += fmt::format("    '{}:{}'\n", command.help.name, zsh_text(command.help.summary));
    cases += fmt::format("    {})\n      _arguments", command.help.name);
    std::size_t places = 0, place = 0;
    for (const OptionText& option : command.options) places += option.is_positional() ? 1 : 0;
    for (const OptionText& option : command.options) {
      if (option.is_positional()) {
        ++place;
        const std::string where = place == places && option.takes == Takes::files ? "*" : std::to_string(place);
        // An effect's list is in a variable, so these are in double quotes.
        cases += option.takes == Takes::effect ? fmt::format(" \\\n        \"{}{}\"", where, zsh_value(option))
                                               : fmt::format(" \\\n        '{}{}'", where, zsh_value(option));
      } else if (option.takes == Takes::effect) {
        cases +=
            fmt::format(" \\\n        '*{}[{}]'\"{}\"", option.name, zsh_text(brief(option.help)), zsh_value(option));
      } else {
        cases += fmt::format(" \\\n        '*{}[{}]{}'", option.name, zsh_text(brief(option.help)), zsh_value(option));
      }
    }
    cases += "\n      ;;\n";
  }
  return fmt::format(R"(#compdef flexspline
# Completion of flexspline for zsh: put it as _flexspline into a folder of $fpath.
# Made by {}.
_flexspline() {{
  local -a commands
  local command effects='{}'
  commands=(
{}  )
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  command=$words[2]
  shift words
  (( CURRENT-- ))
  case $command in
{}  esac
}}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
  _flexspline "$@"
else
  compdef _flexspline flexspline
fi
)",
                     text::tool_name(), joined(effects), names, cases);
}

std::string fish_quoted(std::string_view text) {
  return "'" + replaced(replaced(std::string(text), "\\", "\\\\"), "'", "\\'") + "'";
}
std::string fish(const std::vector<CommandText>& commands, const std::vector<std::string>& effects) {
  std::string text = fmt::format(
      "# Completion of flexspline for fish: put it as flexspline.fish into ~/.config/fish/completions.\n# Made by "
      "{}.\nset -g __flexspline_effects {}\ncomplete -c flexspline -f\n",
      text::tool_name(), joined(effects));
  for (const CommandText& command : commands) {
    text += fmt::format("complete -c flexspline -n __fish_use_subcommand -a {} -d {}\n", command.help.name,
                        fish_quoted(command.help.summary));
    const std::string here =
        fmt::format("complete -c flexspline -n '__fish_seen_subcommand_from {}'", command.help.name);
    for (const OptionText& option : command.options) {
      std::string offer;
      if (option.takes == Takes::files) offer = " -F";
      if (option.takes == Takes::effect) offer = " -a '$__flexspline_effects'";
      if (option.takes == Takes::choice) offer = fmt::format(" -a {}", fish_quoted(joined(option.choices)));
      if (option.value == "DRIVE") offer = " -a twin";
      if (option.is_positional()) {
        if (!offer.empty()) text += here + offer + "\n";
        continue;
      }
      text += fmt::format("{} -l {}{}{} -d {}\n", here, option.name.substr(2),
                          option.takes == Takes::nothing ? "" : " -r", offer, fish_quoted(brief(option.help)));
    }
  }
  return text;
}

std::string completion_script(std::string_view shell, const std::vector<CommandText>& commands,
                              const std::vector<std::string>& effects) {
  if (shell == "bash") return bash(commands, effects);
  if (shell == "zsh") return zsh(commands, effects);
  if (shell == "fish") return fish(commands, effects);
  throw UsageError(fmt::format("there is no completion for \"{}\"; there is one for bash, zsh and fish", shell));
}

int run(const CompletionOptions& options, Console& console) {
  std::vector<std::string> effects;
  for (const catalogue::Entry& entry : catalogue::all()) effects.emplace_back(entry.info->name);
  const std::string script = completion_script(options.shell, option_tree(all_commands()), effects);
  if (options.json != "-") fmt::print("{}", script);
  output::save_json(options.json,
                    {{"format", "flexspline-completion/1"}, {"shell", options.shell}, {"script", script}});
  static_cast<void>(console);
  return kDone;
}

void declare(Parser& parser, CompletionOptions& options) {
  parser.option("SHELL", options.shell, "bash, zsh or fish").required().value("{bash,zsh,fish}");
}

}  // namespace

Command completion_command() {
  return command<CompletionOptions>(
      {"completion",
       "a script by which a shell completes commands, options and effects",
       "Prints the script for bash, zsh or fish, made from the options that --help shows. bash: flexspline "
       "completion bash > /etc/bash_completion.d/flexspline; zsh: into a folder of $fpath as _flexspline; "
       "fish: ~/.config/fish/completions/flexspline.fish. An installed package brings all three.",
       {"flexspline completion bash"}},
      declare, run);
}

}  // namespace flexspline::cli
