#include "host/output/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexspline::output {
namespace {

// Characters, not bytes: continuation bytes of UTF-8 take no place.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

}  // namespace

Table::Table(std::vector<std::string> head, std::string alignment) : alignment_(std::move(alignment)) {
  rows_.push_back(std::move(head));
}

void Table::row(std::vector<std::string> cells) {
  rows_.push_back(std::move(cells));
}

std::string Table::text(std::size_t indent) const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], width_of(row[c]));
  }
  std::string text;
  for (const auto& row : rows_) {
    if (!text.empty()) text += '\n';
    std::string line(indent, ' ');
    for (std::size_t c = 0; c < row.size(); ++c) {
      const char side = alignment_.empty() ? 'l' : alignment_[std::min(c, alignment_.size() - 1)];
      const std::string pad(widths[c] - width_of(row[c]), ' ');
      if (c > 0) line += "  ";
      line += side == 'r' ? pad + row[c] : row[c] + pad;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line;
  }
  return text;
}

std::string wrapped(std::string_view text, std::size_t indent, std::size_t hang) {
  const std::size_t first_indent = indent;
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
    if (!line.empty() && indent + width_of(line) + 1 + width_of(word) > kLineWidth) flush();
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
