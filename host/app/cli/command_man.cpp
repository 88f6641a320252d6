#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/app.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/option_tree.hpp"
#include "host/common/text/build_identity.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::cli {
namespace {

struct ManOptions {
  std::string json;
};

// Text as it is: no dash becomes a hyphen, no line a request.
std::string plain(std::string_view text) {
  std::string roff;
  bool at_line_start = true;
  for (const char c : text) {
    if (at_line_start && (c == '.' || c == '\'')) roff += "\\&";
    if (c == '\\')
      roff += "\\e";
    else if (c == '-')
      roff += "\\-";
    else if (c == '\'')
      roff += "\\(aq";
    else if (c == '"')
      roff += "\\(dq";
    else
      roff += c;
    at_line_start = c == '\n';
  }
  return roff;
}
// An option's name and value, the first bold, the other in italics.
std::string label(const OptionText& option) {
  std::string value = option.value;
  if (value.empty())
    for (const std::string& choice : option.choices) value += (value.empty() ? "" : "|") + choice;
  if (option.is_positional()) return fmt::format("\\fI{}\\fR", plain(option.name));
  if (option.takes == OptionText::Takes::nothing) return fmt::format("\\fB{}\\fR", plain(option.name));
  return fmt::format("\\fB{}\\fR \\fI{}\\fR", plain(option.name), plain(value));
}

std::string command_part(const CommandText& command) {
  const CommandHelp& help = command.help;
  std::string page =
      fmt::format(".SS {}\n{}.\n.PP\n{}\n", plain(help.name), plain(help.summary), plain(help.description));
  for (const OptionText& option : command.options) {
    if (option.name == "--help") continue;
    page += fmt::format(".TP\n{}\n{}{}{}\n", label(option), plain(option.help),
                        option.usual.empty() ? "" : fmt::format(" (default: {})", plain(option.usual)),
                        option.required ? "; needed" : "");
  }
  page += ".PP\nExample:\n.PP\n.nf\n.RS 4\n";
  for (const std::string_view line : help.examples) page += plain(line) + "\n";
  return page + ".RE\n.fi\n";
}

std::string man_page(const std::vector<CommandText>& commands) {
  std::string page = fmt::format(
      ".\\\" Made by {0}.\n.TH FLEXSPLINE 1 \"\" \"flexspline {1}\" \"User Commands\"\n.nh\n.ad l\n.SH "
      "NAME\nflexspline "
      "\\- identifies drives with strain\\-wave gears and finds what a model of one lacks\n.SH SYNOPSIS\n"
      ".B flexspline\n.I COMMAND\n.RI [ OPTIONS ]\n.br\n.B flexspline\n.I COMMAND\n.B \\-\\-help\n.br\n.B flexspline "
      "\\-\\-version\n.SH DESCRIPTION\n"
      "Reads recorded motion of a drive, estimates the parameters of a model, compares the model with the measurement, "
      "names the physical effect that it lacks, adds it, and brings the result onto a drive. Quantities are in SI.\n",
      plain(text::tool_name()), text::version());
  page += ".SH COMMANDS\n";
  for (const CommandText& command : commands) page += command_part(command);
  page +=
      ".SH EXIT STATUS\n.TP\n.B 0\nThe command did its work, whatever the verdict.\n.TP\n.B 1\nA limit that was given "
      "is not met, or a verification failed.\n.TP\n.B 2\nUnusable input or arguments, reported on standard error.\n"
      ".SH ENVIRONMENT\n.TP\n.B NO_COLOR\nNo colours on a terminal.\n.TP\n.B XDG_STATE_HOME\nWhere \\fB\\-\\-drive "
      "twin\\fR keeps its flash memory.\n.SH FILES\nFormats are described in the documents that come with the program "
      "(share/doc/flexspline).\n";
  return page;
}

int run(const ManOptions& options, Console& console) {
  const std::string page = man_page(option_tree(all_commands()));
  if (options.json != "-") fmt::print("{}", page);
  output::save_json(options.json, {{"format", "flexspline-man/1"}, {"page", page}});
  static_cast<void>(console);
  return kDone;
}

void declare(Parser&, ManOptions&) {}

}  // namespace

Command man_command() {
  return command<ManOptions>(
      {"man",
       "this help as a man page",
       "Prints the page in roff, made from the texts and options that --help shows: flexspline man > "
       "flexspline.1, then man -l flexspline.1. An installed package brings it: man flexspline.",
       {"flexspline man"}},
      declare, run);
}

}  // namespace flexspline::cli
