#include "host/input/data/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "host/common/text/shortened.hpp"
#include "host/input/data/csv_fields.hpp"
#include "host/input/data/text_file.hpp"

namespace flexspline::data {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// Of a field in a message.
constexpr std::size_t kLongestField = 60;

// Seconds since the first of a file's time stamps: nanoseconds since 1970 have more digits than a double.
class Stamps {
 public:
  double seconds(std::int64_t stamp_ns) {
    if (!any_) first_ns_ = stamp_ns;
    any_ = true;
    // A time of day starts again from zero at midnight.
    if (stamp_ns < kDay_ns && before_ns_ - stamp_ns > kDay_ns / 2) ++days_;
    before_ns_ = stamp_ns;
    return 1e-9 * static_cast<double>(stamp_ns - first_ns_ + days_ * kDay_ns);
  }
  bool any() const { return any_; }

 private:
  static constexpr std::int64_t kDay_ns = 86'400'000'000'000;
  bool any_ = false;
  std::int64_t first_ns_ = 0;
  std::int64_t before_ns_ = 0;
  std::int64_t days_ = 0;
};

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

constexpr std::size_t kUnwanted = std::numeric_limits<std::size_t>::max();

// The lines of data, one after the other, into the columns of a table.
class LineReader {
 public:
  // `column_indices`: for each field of a line the table's column, or kUnwanted.
  LineReader(char separator, std::vector<std::size_t> column_indices, Table& table)
      : separator_(separator), column_indices_(std::move(column_indices)), table_(table) {}

  // The line without its end. A comment, or only blanks and separators, is passed over.
  bool is_data(const char* at, const char* line_stop) const {
    const char* first = at;
    while (first < line_stop && is_blank(*first)) ++first;
    // Spreadsheets append lines of semicolons or commas only.
    return !(first == line_stop || *first == '#' ||
             std::all_of(first, line_stop, [&](char c) { return c == separator_ || is_blank(c); }));
  }

  void read(const char* at, const char* line_stop, std::size_t line_number) {
    row_ = table_.lines.size();
    line_number_ = line_number;
    for (std::vector<double>& column : table_.columns) column.push_back(kNan);
    table_.lines.push_back(static_cast<std::uint32_t>(line_number));
    const std::size_t bad_before = table_.bad_cells.size();
    std::size_t fields = 0;
    bool surplus = false;
    for (bool more = true; more; ++fields) {
      if (separator_ == ' ')
        while (at < line_stop && is_blank(*at)) ++at;
      const char* stop = nullptr;
      if (fields < column_indices_.size() && column_indices_[fields] != kUnwanted) {
        stop = read_field(at, line_stop, column_indices_[fields]);
      } else {
        stop = field_end(at, line_stop, separator_);
        surplus = surplus || (fields >= column_indices_.size() && !trimmed(text_of(at, stop)).empty());
      }
      more = stop != line_stop;
      at = stop + 1;
    }
    if (!surplus && fields >= column_indices_.size()) return;
    table_.bad_cells.resize(bad_before);
    table_.bad_rows.push_back({row_, fields});
    for (std::vector<double>& column : table_.columns) column[row_] = kNan;
  }

  void finish() {
    table_.time_stamps = stamps_.any();
    if (decimal_points_) table_.mixed_decimals_line = decimal_comma_line_;
  }

 private:
  static std::string_view text_of(const char* at, const char* stop) {
    return {at, static_cast<std::size_t>(stop - at)};
  }

  // Returns the end of the field.
  const char* read_field(const char* at, const char* line_stop, std::size_t column) {
    const char* stop = read_plain(at, line_stop, table_.columns[column][row_]);
    if (stop == nullptr) {
      stop = field_end(at, line_stop, separator_);
      take_other(text_of(at, stop), column);
    }
    if (separator_ != ',' && !decimal_points_)
      decimal_points_ = std::memchr(at, '.', static_cast<std::size_t>(stop - at)) != nullptr;
    return stop;
  }

  // A plain number, which nearly all fields are; null and no value where it is none.
  const char* read_plain(const char* at, const char* line_stop, double& into) const {
    double value = 0.0;
    while (at < line_stop && *at == ' ') ++at;
    const auto ends_field = [&](const char* parsed) { return parsed == line_stop || *parsed == separator_; };
    const char* parsed = plain_decimal(at, line_stop, value);
    if (parsed == nullptr || !ends_field(parsed)) {
      const auto [general, error] = std::from_chars(at, line_stop, value);
      parsed = error == std::errc{} && ends_field(general) && std::isfinite(value) ? general : nullptr;
    }
    if (parsed != nullptr) into = value;
    return parsed;
  }

  // A time stamp, a number with a decimal comma, or none.
  void take_other(std::string_view field, std::size_t column) {
    const Number number = number_from_field(field, separator_);
    table_.columns[column][row_] = number.stamp_ns ? stamps_.seconds(*number.stamp_ns) : number.value;
    if (number.bad)
      table_.bad_cells.push_back({row_, column, *number.bad, text::shortened(unquoted(field), kLongestField)});
    if (number.decimal_comma && decimal_comma_line_ == 0) decimal_comma_line_ = line_number_;
  }

  const char separator_;
  const std::vector<std::size_t> column_indices_;
  Table& table_;
  Stamps stamps_;
  std::size_t row_ = 0;
  std::size_t line_number_ = 0;
  bool decimal_points_ = false;
  std::size_t decimal_comma_line_ = 0;
};

// By the length of the first line.
void reserve(Table& table, std::size_t estimate) {
  for (std::vector<double>& column : table.columns) column.reserve(estimate);
  table.lines.reserve(estimate);
}

bool is_end_mark(const char* at, const char* line_stop) {
  while (at < line_stop && is_blank(*at)) ++at;
  return std::string_view(at, static_cast<std::size_t>(line_stop - at)) == "EOF";
}

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
  std::vector<std::size_t> column_indices(header_.names.size(), kUnwanted);
  for (std::size_t i = 0; i < wanted.size(); ++i) column_indices[wanted[i]] = i;
  Table table;
  table.columns.resize(wanted.size());
  const char* at = text_.data() + header_.data_begin;
  const char* const text_end = text_.data() + text_.size();
  if (at < text_end) {
    const std::size_t first_line = csv_line_at(text_, header_.data_begin, header_.line_end).text.size() + 1;
    reserve(table, (text_.size() - header_.data_begin) / first_line * 5 / 4 + 16);
  }
  LineReader lines(header_.separator, std::move(column_indices), table);
  for (std::size_t line_number = header_.data_line; at < text_end; ++line_number) {
    const void* found = std::memchr(at, header_.line_end, static_cast<std::size_t>(text_end - at));
    const char* line_stop = found == nullptr ? text_end : static_cast<const char*>(found);
    const char* const next = line_stop == text_end ? text_end : line_stop + 1;
    if (line_stop > at && line_stop[-1] == '\r') --line_stop;
    if (header_.separator == ' ')
      while (line_stop > at && is_blank(line_stop[-1])) --line_stop;
    if (lines.is_data(at, line_stop)) {
      // The mark of scopes for a file that was written to its end.
      if (next == text_end && is_end_mark(at, line_stop)) break;
      lines.read(at, line_stop, line_number);
    }
    at = next;
  }
  lines.finish();
  return table;
}

}  // namespace flexspline::data
