// --help within the width of the terminal. A class over CLI11's: command_line.cpp alone has its header, and includes it
// before this one.
#pragma once

#include <string>

#include "host/output/answers/text.hpp"

namespace flexspline::cli {

class HelpFormat : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return two_columns("  " + make_option_name(option, is_positional) + make_option_opts(option),
                       make_option_desc(option));
  }
  std::string make_subcommand(const CLI::App* command) const override {
    return two_columns("  " + command->get_name(), command->get_description());
  }

 private:
  static std::string two_columns(const std::string& name, const std::string& text) {
    const std::size_t width = output::line_width();
    const std::size_t column = width < 70 ? 6 : 30;
    std::string out = name;
    // A text that is too long for its column gets a line of its own.
    if (name.size() + 1 > column)
      out += "\n" + std::string(column, ' ');
    else
      out += std::string(column - name.size(), ' ');
    bool first = true;
    for (const std::string& line : output::lines_of(text, width - column)) {
      if (!first) out += "\n" + std::string(column, ' ');
      out += line;
      first = false;
    }
    return out + "\n";
  }
};

}  // namespace flexspline::cli
