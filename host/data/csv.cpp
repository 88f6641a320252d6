#include "host/data/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "host/data/csv_fields.hpp"
#include "host/data/text_file.hpp"
#include "host/text/shortened.hpp"

namespace flexspline::data {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// Of a field in a message.
constexpr std::size_t kLongestField = 60;

// Seconds since the first of a file's time stamps: nanoseconds since 1970 have more digits than a double.
class Stamps {
 public:
  double seconds(std::int64_t stamp_ns) {
    if (!first_ns_) first_ns_ = stamp_ns;
    // A time of day starts again from zero at midnight.
    if (stamp_ns < kDay_ns && before_ns_ - stamp_ns > kDay_ns / 2) ++days_;
    before_ns_ = stamp_ns;
    return 1e-9 * static_cast<double>(stamp_ns - *first_ns_ + days_ * kDay_ns);
  }
  bool any() const { return first_ns_.has_value(); }

 private:
  static constexpr std::int64_t kDay_ns = 86'400'000'000'000;
  std::optional<std::int64_t> first_ns_;
  std::int64_t before_ns_ = 0;
  std::int64_t days_ = 0;
};

}  // namespace

CsvFile::CsvFile(const std::filesystem::path& path, Findings& findings) : text_(read_text(path, findings)) {
  const std::string file = path.string();
  if (const auto wrong = read_csv_header(text_, header_))
    findings.fail("header", file, wrong->line, wrong->what,
                  "write the names of the columns into the first line: time_s,current_a,...");
  const auto note = [&](const char* kind, std::size_t line, std::string what) {
    findings.add(Severity::note, kind, file, line, "", std::move(what), "");
  };
  if (header_.skipped > 0)
    note("header", header_.line,
         fmt::format("the names of the columns are in this line; {} lines before are not read", header_.skipped));
  if (header_.units_line > 0)
    note("unit", header_.units_line, "this line holds the units of the columns; they are used");
  if (header_.latin1) note("header", header_.line, "the names are not UTF-8; they were read as Latin-1");
}

std::string CsvFile::unit(std::size_t name) const {
  return name < header_.units.size() ? header_.units[name] : std::string();
}

Table CsvFile::read(std::span<const std::size_t> wanted) const {
  constexpr std::size_t kUnwanted = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> column_indices(header_.names.size(), kUnwanted);
  for (std::size_t i = 0; i < wanted.size(); ++i) column_indices[wanted[i]] = i;

  const char separator = header_.separator;
  Stamps stamps;
  Table table;
  table.columns.resize(wanted.size());
  const char* at = text_.data() + header_.data_begin;
  const char* const text_end = text_.data() + text_.size();
  if (at < text_end) {
    const std::size_t first_line = csv_line_at(text_, header_.data_begin, header_.line_end).text.size() + 1;
    const std::size_t estimate = (text_.size() - header_.data_begin) / first_line * 5 / 4 + 16;
    for (std::vector<double>& column : table.columns) column.reserve(estimate);
    table.lines.reserve(estimate);
  }

  bool decimal_points = false;
  std::size_t decimal_comma_line = 0;
  std::size_t line_number = header_.data_line;
  for (; at < text_end; ++line_number) {
    const void* found = std::memchr(at, header_.line_end, static_cast<std::size_t>(text_end - at));
    const char* line_stop = found == nullptr ? text_end : static_cast<const char*>(found);
    const char* const next = line_stop == text_end ? text_end : line_stop + 1;
    if (line_stop > at && line_stop[-1] == '\r') --line_stop;
    if (separator == ' ')
      while (line_stop > at && is_blank(line_stop[-1])) --line_stop;
    const char* first = at;
    while (first < line_stop && is_blank(*first)) ++first;
    // Spreadsheets append lines of semicolons or commas only.
    if (first == line_stop || *first == '#' ||
        std::all_of(first, line_stop, [&](char c) { return c == separator || is_blank(c); })) {
      at = next;
      continue;
    }

    // The mark of scopes for a file that was written to its end.
    if (std::string_view(first, static_cast<std::size_t>(line_stop - first)) == "EOF" && next == text_end) break;

    const std::size_t row = table.lines.size();
    for (std::vector<double>& column : table.columns) column.push_back(kNan);
    table.lines.push_back(static_cast<std::uint32_t>(line_number));
    std::size_t fields = 0;
    const std::size_t bad_before = table.bad_cells.size();
    bool more = true;
    bool surplus = false;
    while (more) {
      const std::size_t column_index = fields < column_indices.size() ? column_indices[fields] : kUnwanted;
      if (separator == ' ')
        while (at < line_stop && is_blank(*at)) ++at;
      const char* stop = nullptr;
      if (column_index != kUnwanted) {
        double value = 0.0;
        const char* begin = at;
        while (begin < line_stop && *begin == ' ') ++begin;
        const auto ends_field = [&](const char* parsed) { return parsed == line_stop || *parsed == separator; };
        const char* parsed = plain_decimal(begin, line_stop, value);
        if (parsed == nullptr || !ends_field(parsed)) {
          const auto [general, error] = std::from_chars(begin, line_stop, value);
          parsed = error == std::errc{} && ends_field(general) && std::isfinite(value) ? general : nullptr;
        }
        if (parsed != nullptr) {
          table.columns[column_index][row] = value;
          stop = parsed;
        }
      }
      if (stop == nullptr) {
        stop = field_end(at, line_stop, separator);
        const std::string_view field(at, static_cast<std::size_t>(stop - at));
        if (column_index != kUnwanted) {
          const Number number = number_from_field(field, separator);
          table.columns[column_index][row] = number.value;
          if (number.stamp_ns) table.columns[column_index][row] = stamps.seconds(*number.stamp_ns);
          if (number.bad)
            table.bad_cells.push_back(
                {row, column_index, *number.bad, text::shortened(unquoted(field), kLongestField)});
          if (number.decimal_comma && decimal_comma_line == 0) decimal_comma_line = line_number;
        }
        if (fields >= column_indices.size() && !trimmed(field).empty()) surplus = true;
      }
      if (separator != ',' && column_index != kUnwanted && !decimal_points)
        decimal_points = std::memchr(at, '.', static_cast<std::size_t>(stop - at)) != nullptr;
      ++fields;
      more = stop != line_stop;
      at = stop + 1;
    }
    if (surplus || fields < header_.names.size()) {
      table.bad_cells.resize(bad_before);
      table.bad_rows.push_back({row, fields});
      for (std::vector<double>& column : table.columns) column[row] = kNan;
    }
    at = next;
  }
  table.time_stamps = stamps.any();
  if (decimal_points) table.mixed_decimals_line = decimal_comma_line;
  return table;
}

}  // namespace flexspline::data
