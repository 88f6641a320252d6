// The commands with their options as plain data, taken from the parser that reads them: --help, completion and the man
// page cannot differ.
#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

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
  std::string name;
  std::string summary;
  std::vector<OptionText> options;
};

using OptionTree = std::function<std::vector<CommandText>()>;

namespace detail {
// From "NAME:{one,two}", as the parser describes a value with its checks.
inline std::vector<std::string> choices_of(const std::string& type) {
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
inline bool names_files(std::string_view value) {
  constexpr std::string_view kFiles[] = {"FILE", "FILE.toml", "PATH",  "DIR",   "MODEL", "OUT",     "BLOCK",
                                         "PLAN", "DATA",      "IMAGE", "TASKS", "PLANT", "RESULTS", "FOLDER"};
  return std::find(std::begin(kFiles), std::end(kFiles), value) != std::end(kFiles);
}
}  // namespace detail

// Of a parser as CLI11 has them; a template, so that its header stays in one file.
template <class Parser>
std::vector<CommandText> option_tree_of(const Parser& app) {
  std::vector<CommandText> commands;
  for (const Parser* sub : app.get_subcommands([](const Parser* one) { return !one->get_group().empty(); })) {
    CommandText command{sub->get_name(), sub->get_description(), {}};
    for (const auto* option : sub->get_options()) {
      OptionText text;
      text.name = option->get_positional() ? option->get_name(true) : "--" + option->get_lnames().front();
      const std::string type = option->get_type_name();
      text.value = type.substr(0, type.find_first_of(":{"));
      text.choices = detail::choices_of(type);
      text.help = option->get_description();
      text.usual = option->get_default_str();
      text.required = option->get_required();
      const std::string& kind = text.is_positional() ? text.name : text.value;
      if (option->get_items_expected_max() == 0)
        text.takes = OptionText::Takes::nothing;
      else if (!text.choices.empty())
        text.takes = OptionText::Takes::choice;
      else if (kind == "EFFECT" || (text.is_positional() && kind == "NAME"))
        text.takes = OptionText::Takes::effect;
      else if (detail::names_files(kind))
        text.takes = OptionText::Takes::files;
      command.options.push_back(std::move(text));
    }
    commands.push_back(std::move(command));
  }
  return commands;
}

}  // namespace flexspline::cli
