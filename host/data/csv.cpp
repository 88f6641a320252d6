#include "host/data/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>

namespace flexspline::data {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view unquoted(std::string_view field) {
  field = trimmed(field);
  if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
    field = trimmed(field.substr(1, field.size() - 2));
  return field;
}

// First separator outside quotes at or after `at`, or the end of the line.
const char* field_end(const char* at, const char* end, char separator) {
  const char* begin = at;
  while (begin < end && *begin == ' ') ++begin;
  if (begin < end && *begin == '"') {
    const char* quote =
        static_cast<const char*>(std::memchr(begin + 1, '"', static_cast<std::size_t>(end - begin - 1)));
    if (quote != nullptr) at = quote + 1;
  }
  if (at == end) return end;
  const void* found = std::memchr(at, separator, static_cast<std::size_t>(end - at));
  return found == nullptr ? end : static_cast<const char*>(found);
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  const char* at = line.data();
  const char* const end = at + line.size();
  while (true) {
    const char* stop = field_end(at, end, separator);
    fields.push_back(unquoted({at, static_cast<std::size_t>(stop - at)}));
    if (stop == end) return fields;
    at = stop + 1;
  }
}

// The one of tab, semicolon and comma that stands most often outside quotes.
char separator_of(std::string_view line) {
  constexpr std::string_view kSeparators = "\t;,";
  std::array<std::size_t, 3> count{};
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    const std::size_t which = quoted ? std::string_view::npos : kSeparators.find(c);
    if (which != std::string_view::npos) ++count[which];
  }
  const auto most = std::max_element(count.begin(), count.end());
  return *most == 0 ? ',' : kSeparators[static_cast<std::size_t>(most - count.begin())];
}

struct Number {
  double value = kNan;
  std::optional<BadCell::Kind> bad;
  bool decimal_comma = false;
};

// A whole field, the slow and tolerant way: blanks, quotes, a plus sign, a decimal comma, words for missing values.
Number number_from_field(std::string_view field, char separator) {
  field = unquoted(field);
  Number number;
  if (field.empty()) {
    number.bad = BadCell::Kind::empty;
    return number;
  }
  for (const std::string_view missing : {"NA", "N/A", "#N/A", "null", "NULL", "None"})
    if (field == missing) {
      number.bad = BadCell::Kind::not_finite;
      return number;
    }
  std::string point(field.front() == '+' ? field.substr(1) : field);
  if (separator != ',' && std::count(point.begin(), point.end(), ',') == 1 && point.find('.') == std::string::npos) {
    std::replace(point.begin(), point.end(), ',', '.');
    number.decimal_comma = true;
  }
  double value = 0.0;
  const auto [stop, error] = std::from_chars(point.data(), point.data() + point.size(), value);
  if (error == std::errc::invalid_argument || stop != point.data() + point.size() || point.front() == '+') {
    number.bad = BadCell::Kind::text;
    number.decimal_comma = false;
  } else if (error == std::errc::result_out_of_range && point.find("e-") != std::string::npos) {
    number.value = 0.0;  // too small for a double
  } else if (error != std::errc{} || !std::isfinite(value)) {
    number.bad = BadCell::Kind::not_finite;
  } else {
    number.value = value;
  }
  return number;
}

// Digits with at most one point, as loggers write them. All digits together below 2^53 and a power of ten up to 10^22
// are doubles without error, so that one division rounds once: the same bits as std::from_chars, in a third of its
// time. nullptr for all else.
const char* plain_decimal(const char* at, const char* end, double& value) {
  static constexpr std::array<double, 20> kPowersOfTen{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,
                                                       1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19};
  const bool negative = at < end && *at == '-';
  if (negative) ++at;
  std::uint64_t digits = 0;
  const auto take = [&] {
    const char* const first = at;
    for (; at < end && *at >= '0' && *at <= '9'; ++at) digits = 10 * digits + static_cast<std::uint64_t>(*at - '0');
    return static_cast<std::size_t>(at - first);
  };
  std::size_t count = take(), decimals = 0;
  if (at < end && *at == '.') {
    ++at;
    decimals = take();
    count += decimals;
  }
  // More than 19 digits may have run over.
  if (count == 0 || count > 19 || digits > std::uint64_t{1} << 53) return nullptr;
  value = static_cast<double>(digits) / kPowersOfTen[decimals];
  if (negative) value = -value;
  return at;
}

bool is_number(std::string_view field, char separator) {
  const Number number = number_from_field(field, separator);
  return !number.bad || *number.bad == BadCell::Kind::not_finite;
}

std::string read_whole(const std::filesystem::path& path, Findings& findings) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file)
    findings.fail("file", path.string(), 0, "cannot read this file", "check the path and the permissions");
  std::string text(size, '\0');
  file.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

void refuse_what_is_not_csv(const std::filesystem::path& path, const std::string& text, Findings& findings) {
  const std::string file = path.string();
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    findings.fail("header", file, 0, "the file is empty", "record again, or leave the file out");
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    findings.fail("format", file, 0, "the file is UTF-16 text", "save it as CSV in UTF-8");
  if (std::memchr(text.data(), '\0', std::min<std::size_t>(text.size(), 65536)) != nullptr)
    findings.fail("format", file, 0, "this is a binary file, neither CSV text nor MAT",
                  "export the measurement as CSV or MAT");
}

struct Line {
  std::string_view text;
  std::size_t next = 0;
};

Line line_at(const std::string& text, std::size_t begin, char line_end) {
  const std::size_t end = std::min(text.find(line_end, begin), text.size());
  std::string_view line = std::string_view(text).substr(begin, end - begin);
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  while (!line.empty() && line.front() == ' ') line.remove_prefix(1);  // not a tab: an empty first field
  return {line, std::min(end + 1, text.size())};
}

}  // namespace

CsvFile::CsvFile(const std::filesystem::path& path, Findings& findings) : text_(read_whole(path, findings)) {
  refuse_what_is_not_csv(path, text_, findings);
  if (text_.find('\n') == std::string::npos && text_.find('\r') != std::string::npos) line_end_ = '\r';
  read_header(path.string(), findings);
}

void CsvFile::read_header(const std::string& file, Findings& findings) {
  std::size_t at = text_.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  std::string_view last_comment;
  std::size_t last_comment_line = 0;
  for (std::size_t number = 1; at < text_.size(); ++number) {
    const std::size_t begin = at;
    const Line line = line_at(text_, at, line_end_);
    at = line.next;
    if (trimmed(line.text).empty()) continue;
    if (line.text.front() == '#') {
      last_comment = trimmed(line.text.substr(1));
      last_comment_line = number;
      const std::size_t colon = last_comment.find(':');
      if (colon != std::string_view::npos)
        keys_.push_back({std::string(trimmed(last_comment.substr(0, colon))),
                         std::string(unquoted(last_comment.substr(colon + 1))), number});
      continue;
    }
    separator_ = separator_of(line.text);
    header_line_ = number;
    data_begin_ = at;
    data_line_ = number + 1;
    std::vector<std::string_view> fields = split(line.text, separator_);
    if (std::all_of(fields.begin(), fields.end(), [&](auto f) { return is_number(f, separator_); })) {
      const std::vector<std::string_view> names = split(last_comment, separator_);
      if (fields.size() < 2 || names.size() != fields.size())
        findings.fail("header", file, number, "there is no header line: the first line holds only numbers",
                      "write the names of the columns into the first line: time_s,current_a,...");
      fields = names;
      header_line_ = last_comment_line;
      data_begin_ = begin;
      data_line_ = number;
    }
    names_.assign(fields.begin(), fields.end());
    while (!names_.empty() && names_.back().empty()) names_.pop_back();  // a separator at the end of the line
    return;
  }
  findings.fail("header", file, 0, "there is no header line, only comments",
                "write the names of the columns into the first line: time_s,current_a,...");
}

Table CsvFile::read(std::span<const std::size_t> wanted) const {
  constexpr std::size_t kUnwanted = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> slots(names_.size(), kUnwanted);
  for (std::size_t i = 0; i < wanted.size(); ++i) slots[wanted[i]] = i;

  Table table;
  table.columns.resize(wanted.size());
  const char* at = text_.data() + data_begin_;
  const char* const text_end = text_.data() + text_.size();
  if (at < text_end) {
    const std::size_t first_line = line_at(text_, data_begin_, line_end_).text.size() + 1;
    const std::size_t estimate = (text_.size() - data_begin_) / first_line * 5 / 4 + 16;
    for (std::vector<double>& column : table.columns) column.reserve(estimate);
    table.lines.reserve(estimate);
  }

  bool decimal_points = false;
  std::size_t decimal_comma_line = 0;
  std::size_t line_number = data_line_;
  for (; at < text_end; ++line_number) {
    const void* found = std::memchr(at, line_end_, static_cast<std::size_t>(text_end - at));
    const char* line_stop = found == nullptr ? text_end : static_cast<const char*>(found);
    const char* const next = line_stop == text_end ? text_end : line_stop + 1;
    if (line_stop > at && line_stop[-1] == '\r') --line_stop;
    const char* first = at;
    while (first < line_stop && is_blank(*first)) ++first;
    // A line of nothing but semicolons or commas is what spreadsheets append.
    if (first == line_stop || *first == '#' ||
        std::all_of(first, line_stop, [&](char c) { return c == separator_ || is_blank(c); })) {
      at = next;
      continue;
    }

    const std::size_t row = table.lines.size();
    for (std::vector<double>& column : table.columns) column.push_back(kNan);
    table.lines.push_back(static_cast<std::uint32_t>(line_number));
    std::size_t fields = 0;
    const std::size_t bad_before = table.bad_cells.size();
    bool more = true;
    bool surplus = false;
    while (more) {
      const std::size_t slot = fields < slots.size() ? slots[fields] : kUnwanted;
      const char* stop = nullptr;
      if (slot != kUnwanted) {
        double value = 0.0;
        const char* begin = at;
        while (begin < line_stop && *begin == ' ') ++begin;
        const auto ends_field = [&](const char* parsed) { return parsed == line_stop || *parsed == separator_; };
        const char* parsed = plain_decimal(begin, line_stop, value);
        if (parsed == nullptr || !ends_field(parsed)) {
          const auto [general, error] = std::from_chars(begin, line_stop, value);
          parsed = error == std::errc{} && ends_field(general) && std::isfinite(value) ? general : nullptr;
        }
        if (parsed != nullptr) {
          table.columns[slot][row] = value;
          stop = parsed;
        }
      }
      if (stop == nullptr) {
        stop = field_end(at, line_stop, separator_);
        const std::string_view field(at, static_cast<std::size_t>(stop - at));
        if (slot != kUnwanted) {
          const Number number = number_from_field(field, separator_);
          table.columns[slot][row] = number.value;
          if (number.bad) table.bad_cells.push_back({row, slot, *number.bad, std::string(unquoted(field))});
          if (number.decimal_comma && decimal_comma_line == 0) decimal_comma_line = line_number;
        }
        if (fields >= slots.size() && !trimmed(field).empty()) surplus = true;
      }
      if (separator_ != ',' && slot != kUnwanted && !decimal_points)
        decimal_points = std::memchr(at, '.', static_cast<std::size_t>(stop - at)) != nullptr;
      ++fields;
      more = stop != line_stop;
      at = stop + 1;
    }
    if (surplus || fields < names_.size()) {
      table.bad_cells.resize(bad_before);
      table.bad_rows.push_back({row, fields});
      for (std::vector<double>& column : table.columns) column[row] = kNan;
    }
    at = next;
  }
  if (decimal_points) table.mixed_decimals_line = decimal_comma_line;
  return table;
}

}  // namespace flexspline::data
