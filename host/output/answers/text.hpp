// Tables and paragraphs for a terminal.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexspline::output {

// Characters in a line: of the terminal, or as COLUMNS has it, but no more than is easy to read; 110 for other outputs.
std::size_t line_width();

// Columns as wide as their widest cell, two blanks apart. Widths are counted in characters of UTF-8.
class Table {
 public:
  // `alignment`: one letter a column, l or r; the last one holds for all that follow.
  Table(std::vector<std::string> head, std::string alignment);
  void row(std::vector<std::string> cells);
  bool empty() const { return rows_.size() <= 1; }
  // Each line begins with `indent` blanks; no line feed at the end.
  std::string text(std::size_t indent = 2) const;
  // The same within `width`: the widest columns are broken at blanks, so that a row may take several lines.
  std::string text_within(std::size_t width, std::size_t indent = 2) const;

 private:
  std::vector<std::size_t> widths_within(std::size_t width) const;

  std::vector<std::vector<std::string>> rows_;  // the head first
  std::string alignment_;
};

// A paragraph broken at blanks into lines of at most line_width() characters, each after `indent` blanks and all but
// the first after `hang` more.
std::string wrapped(std::string_view text, std::size_t indent = 2, std::size_t hang = 0);
// The lines of a text broken at blanks, at most `width` characters each; a longer word stays whole.
std::vector<std::string> lines_of(std::string_view text, std::size_t width);

// Significant digits; "-" for what is not known.
std::string number(double value, int digits = 4);
std::string number(const std::optional<double>& value, int digits = 4);
// "12.3 N*m", "0.5" where the unit is 1 or empty.
std::string with_unit(double value, std::string_view unit);

// "a", "a and b", "a, b and c".
std::string listed(const std::vector<std::string>& items, std::string_view last_joint = "and");

}  // namespace flexspline::output
