#include "host/output/answers/text.hpp"

#include <fmt/format.h>

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <utility>

namespace flexspline::output {
namespace {

// Characters, not bytes: continuation bytes of UTF-8 take no place.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

// Takes from the widest columns, none below its narrowest width, until all fit.
void shrink(std::vector<std::size_t>& widths, const std::vector<std::size_t>& narrowest, std::size_t width) {
  while (std::accumulate(widths.begin(), widths.end(), 2 * widths.size()) > width) {
    std::size_t widest = widths.size();
    for (std::size_t c = 0; c < widths.size(); ++c)
      if (widths[c] > narrowest[c] && (widest == widths.size() || widths[c] > widths[widest])) widest = c;
    if (widest == widths.size()) return;
    --widths[widest];
  }
}

// Its lines, and words that are longer than `width` in pieces of ASCII.
std::vector<std::string> lines_of_cell(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  for (std::string& line : lines_of(text, width)) {
    while (line.size() > width && width_of(line) > width) {
      lines.push_back(line.substr(0, width));
      line.erase(0, width);
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace

Table::Table(std::vector<std::string> head, std::string alignment) : alignment_(std::move(alignment)) {
  rows_.push_back(std::move(head));
}

void Table::row(std::vector<std::string> cells) {
  rows_.push_back(std::move(cells));
}

std::string Table::text(std::size_t indent) const {
  return text_within(std::numeric_limits<std::size_t>::max(), indent);
}

std::vector<std::size_t> Table::widths_within(std::size_t width) const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], width_of(row[c]));
  }
  if (std::accumulate(widths.begin(), widths.end(), 2 * widths.size()) <= width) return widths;
  // No narrower than the longest word, which stays whole.
  std::vector<std::size_t> narrowest(widths.size(), 1);
  for (const auto& row : rows_)
    for (std::size_t c = 0; c < row.size(); ++c)
      for (const std::string& word : lines_of(row[c], 1)) narrowest[c] = std::max(narrowest[c], width_of(word));
  shrink(widths, narrowest, width);
  // Where that is not enough, long words are broken after all.
  constexpr std::size_t kFewestOfAWord = 12;
  for (std::size_t& least : narrowest) least = std::min(least, kFewestOfAWord);
  shrink(widths, narrowest, width);
  return widths;
}

std::string Table::text_within(std::size_t width, std::size_t indent) const {
  const std::vector<std::size_t> widths = widths_within(width - std::min(width, indent));
  std::string text;
  for (const auto& row : rows_) {
    std::vector<std::vector<std::string>> cells;
    std::size_t height = 1;
    for (std::size_t c = 0; c < row.size(); ++c) {
      cells.push_back(width_of(row[c]) <= widths[c] ? std::vector<std::string>{row[c]}
                                                    : lines_of_cell(row[c], widths[c]));
      height = std::max(height, cells.back().size());
    }
    for (std::size_t k = 0; k < height; ++k) {
      if (!text.empty()) text += '\n';
      std::string line(indent, ' ');
      for (std::size_t c = 0; c < cells.size(); ++c) {
        const char side = alignment_.empty() ? 'l' : alignment_[std::min(c, alignment_.size() - 1)];
        const std::string cell = k < cells[c].size() ? cells[c][k] : "";
        const std::string pad(widths[c] - std::min(widths[c], width_of(cell)), ' ');
        if (c > 0) line += "  ";
        line += side == 'r' ? pad + cell : cell + pad;
      }
      line.erase(line.find_last_not_of(' ') + 1);
      text += line;
    }
  }
  return text;
}

std::vector<std::string> lines_of(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  std::string line;
  while (!text.empty()) {
    const std::size_t blank = text.find(' ');
    const std::string_view word = text.substr(0, blank);
    text = blank == std::string_view::npos ? std::string_view{} : text.substr(blank + 1);
    if (word.empty()) continue;
    if (!line.empty() && width_of(line) + 1 + width_of(word) > width) lines.push_back(std::exchange(line, {}));
    if (!line.empty()) line += ' ';
    line += word;
  }
  if (!line.empty() || lines.empty()) lines.push_back(line);
  return lines;
}

std::size_t line_width() {
  constexpr std::size_t kUsual = 110, kFewest = 40;
  std::size_t width = kUsual;
  winsize size{};
  if (::isatty(STDOUT_FILENO) != 0 && ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0)
    width = size.ws_col;
  else if (const char* columns = std::getenv("COLUMNS"))
    if (const int stated = std::atoi(columns); stated > 0) width = static_cast<std::size_t>(stated);
  return std::clamp(width, kFewest, kUsual);
}

std::string wrapped(std::string_view text, std::size_t indent, std::size_t hang) {
  const std::size_t first_indent = indent, width = line_width();
  std::string result, line;
  const auto flush = [&] {
    if (line.empty()) return;
    if (!result.empty()) result += '\n';
    result += std::string(indent, ' ') + line;
    indent = first_indent + hang;
    line.clear();
  };
  while (!text.empty()) {
    const std::size_t blank = text.find(' ');
    const std::string_view word = text.substr(0, blank);
    text = blank == std::string_view::npos ? std::string_view{} : text.substr(blank + 1);
    if (word.empty()) continue;
    if (!line.empty() && indent + width_of(line) + 1 + width_of(word) > width) flush();
    if (!line.empty()) line += ' ';
    line += word;
  }
  flush();
  return result;
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : "-";
}
std::string number(const std::optional<double>& value, int digits) {
  return value ? number(*value, digits) : "-";
}

std::string with_unit(double value, std::string_view unit) {
  return unit.empty() || unit == "1" ? number(value) : fmt::format("{} {}", number(value), unit);
}

std::string listed(const std::vector<std::string>& items, std::string_view last_joint) {
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) text += i + 1 == items.size() ? fmt::format(" {} ", last_joint) : ", ";
    text += items[i];
  }
  return text;
}

}  // namespace flexspline::output
