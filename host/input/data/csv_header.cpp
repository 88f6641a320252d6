#include "host/input/data/csv_header.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/input/data/csv_fields.hpp"
#include "host/input/data/text_file.hpp"
#include "host/input/data/units.hpp"

namespace flexspline::data {
namespace {

// Scopes and bus analysers put their settings before the names of the signals.
constexpr std::size_t kMostLinesBefore = 100;
constexpr std::size_t kLongestName = 1000;
constexpr std::size_t kLongestUnit = 16;

struct Row {
  std::size_t number = 0;  // of the line
  std::size_t begin = 0;
  std::size_t next = 0;
  char separator = ',';
  std::vector<std::string_view> fields;  // none empty at the end

  std::size_t numbers() const {
    return static_cast<std::size_t>(
        std::count_if(fields.begin(), fields.end(), [&](auto f) { return is_number(f, separator); }));
  }
  std::size_t empty() const {
    return static_cast<std::size_t>(std::count(fields.begin(), fields.end(), std::string_view{}));
  }
};

Row row_of(const CsvLine& line, std::size_t number, std::size_t begin, std::optional<char> separator = {}) {
  Row row{number, begin, line.next, separator.value_or(separator_of(line.text)), {}};
  row.fields = split(line.text, row.separator);
  while (!row.fields.empty() && row.fields.back().empty()) row.fields.pop_back();
  return row;
}

// Without the brackets around it.
std::string unit_of_field(std::string_view field) {
  if (field.size() >= 2 &&
      ((field.front() == '[' && field.back() == ']') || (field.front() == '(' && field.back() == ')')))
    field = trimmed(field.substr(1, field.size() - 2));
  return is_utf8(field) ? std::string(field) : utf8_from_latin1(field);
}

class HeaderReader {
 public:
  HeaderReader(std::string_view text, CsvHeader& header) : text_(text), header_(header) {}

  std::optional<NoHeader> read() {
    if (text_.find('\n') == std::string_view::npos && text_.find('\r') != std::string_view::npos)
      header_.line_end = '\r';
    at_ = text_.starts_with("\xEF\xBB\xBF") ? 3 : 0;
    const std::vector<Row> rows = first_rows();
    if (rows.empty()) return NoHeader{0, "there is no header line, only comments"};
    if (rows[0].numbers() == rows[0].fields.size()) return names_behind_hash(rows[0]);
    take(rows, row_of_names(rows));
    for (std::size_t i = 0; i < header_.names.size(); ++i)
      if (header_.names[i].size() > kLongestName)
        return NoHeader{header_.line,
                        fmt::format("the name of column {} has {} characters", i + 1, header_.names[i].size())};
    return std::nullopt;
  }

 private:
  // Lines that are neither blank nor comments; as many as may come before the numbers.
  std::vector<Row> first_rows() {
    std::vector<Row> rows;
    for (std::size_t number = 1; at_ < text_.size() && rows.size() < kMostLinesBefore; ++number) {
      const std::size_t begin = at_;
      const CsvLine line = csv_line_at(text_, at_, header_.line_end);
      at_ = line.next;
      if (trimmed(line.text).empty()) continue;
      if (line.text.front() == '#')
        comment(trimmed(line.text.substr(1)), number, rows.empty());
      else
        rows.push_back(row_of(line, number, begin));
    }
    return rows;
  }

  void comment(std::string_view text, std::size_t number, bool before_names) {
    if (!before_names) return;
    last_comment_ = text;
    last_comment_line_ = number;
    const std::size_t colon = text.find(':');
    if (colon != std::string_view::npos)
      header_.keys.push_back(
          {std::string(trimmed(text.substr(0, colon))), std::string(unquoted(text.substr(colon + 1))), number});
  }

  // As NumPy writes it.
  std::optional<NoHeader> names_behind_hash(const Row& first) {
    const std::vector<std::string_view> names = split(last_comment_, first.separator);
    if (first.fields.size() < 2 || names.size() != first.fields.size())
      return NoHeader{first.number, "there is no header line: the first line holds only numbers"};
    set_names(names);
    header_.separator = first.separator;
    header_.line = last_comment_line_;
    header_.data_begin = first.begin;
    header_.data_line = first.number;
    return std::nullopt;
  }

  // Column names of the contract are names, whatever is under them.
  static bool are_ours(const Row& names) {
    return std::any_of(names.fields.begin(), names.fields.end(),
                       [](std::string_view field) { return field == "time_s" || column_from_name(field).has_value(); });
  }

  static bool is_of_numbers(const Row& row) {
    return row.fields.size() >= 2 && row.numbers() + row.empty() == row.fields.size();
  }

  // Two lines of data with text among them, as a state's name. Both begin with a number, as no pair of a setting's name
  // and its value does.
  static bool are_of_numbers_and_text(const Row& one, const Row& next) {
    const auto begins_with_number = [](const Row& row) {
      return row.fields.size() >= 2 && is_number(row.fields.front(), row.separator);
    };
    return begins_with_number(one) && begins_with_number(next) && one.fields.size() == next.fields.size() &&
           2 * one.numbers() >= one.fields.size();
  }

  // The first line, unless the logger wrote lines of its own there: then the last line of names before the numbers
  // begin.
  static std::size_t row_of_names(const std::vector<Row>& rows) {
    if (rows.size() < 2 || are_ours(rows[0])) return 0;
    for (std::size_t k = 1; k < rows.size(); ++k) {
      const Row& numbers = rows[k];
      if (!is_of_numbers(numbers) && !(k + 1 < rows.size() && are_of_numbers_and_text(numbers, rows[k + 1]))) continue;
      if (const auto scope = row_of_channels(rows, k)) return *scope;
      for (std::size_t back = k; back > 0; --back) {
        const Row& names = rows[back - 1];
        const bool as_wide = names.fields.size() == numbers.fields.size() && names.separator == numbers.separator;
        if (as_wide && names.numbers() == 0 && names.empty() == 0 && !is_units(names, names.fields.size()))
          return back - 1;
      }
      return 0;
    }
    return 0;
  }

  // TwinCAT's scope gives each channel two columns, its times and its values, under a block of settings: "Name", the
  // channel's name, "Name", the next one's ...
  static bool is_of_channels(const Row& row) {
    if (row.fields.size() < 2 || row.fields.size() % 2 != 0) return false;
    for (std::size_t i = 0; i < row.fields.size(); i += 2)
      if (row.fields[i] != "Name") return false;
    return true;
  }
  static std::optional<std::size_t> row_of_channels(const std::vector<Row>& rows, std::size_t numbers) {
    for (std::size_t back = numbers; back > 0; --back)
      if (rows[back - 1].fields.size() == rows[numbers].fields.size() && is_of_channels(rows[back - 1]))
        return back - 1;
    return std::nullopt;
  }

  static bool is_units(const Row& row, std::size_t names) {
    if (row.fields.empty() || row.fields.size() > names) return false;
    bool known = false;
    for (const std::string_view field : row.fields) {
      const std::string unit = unit_of_field(field);
      if (unit.size() > kLongestUnit || is_number(field, row.separator)) {
        if (!unit.empty()) return false;
        continue;
      }
      known = known || unit_from_text(unit).has_value();
    }
    return known;
  }

  void take(const std::vector<Row>& rows, std::size_t which) {
    const Row& names = rows[which];
    header_.separator = names.separator;
    header_.line = names.number;
    header_.skipped = which;
    header_.data_begin = names.next;
    header_.data_line = names.number + 1;
    set_names(names.fields);
    if (is_of_channels(names)) return take_channels(rows, which);
    if (which + 1 >= rows.size()) return;
    const CsvLine line = csv_line_at(text_, rows[which + 1].begin, header_.line_end);
    const Row under = row_of(line, rows[which + 1].number, rows[which + 1].begin, names.separator);
    if (!is_units(under, header_.names.size())) return;
    for (const std::string_view field : under.fields) header_.units.push_back(unit_of_field(field));
    header_.units.resize(header_.names.size());
    header_.units_line = under.number;
    header_.data_begin = under.next;
    header_.data_line = under.number + 1;
  }

  void take_channels(const std::vector<Row>& rows, std::size_t which) {
    header_.units.resize(header_.names.size());
    for (std::size_t i = 0; i < header_.names.size(); i += 2) {
      header_.names[i] = i == 0 ? "time" : fmt::format("time of {}", header_.names[i + 1]);
      header_.units[i] = "ms";
    }
    // The settings go on under the names.
    while (++which < rows.size() && rows[which].numbers() < rows[which].fields.size()) {
    }
    if (which == rows.size()) return;
    header_.skipped = which;
    header_.data_begin = rows[which].begin;
    header_.data_line = rows[which].number;
  }

  void set_names(const std::vector<std::string_view>& names) {
    for (const std::string_view name : names) {
      header_.latin1 = header_.latin1 || !is_utf8(name);
      header_.names.push_back(is_utf8(name) ? std::string(name) : utf8_from_latin1(name));
    }
    while (!header_.names.empty() && header_.names.back().empty()) header_.names.pop_back();  // a separator at the end
  }

  std::string_view text_;
  CsvHeader& header_;
  std::size_t at_ = 0;
  std::string_view last_comment_;
  std::size_t last_comment_line_ = 0;
};

}  // namespace

CsvLine csv_line_at(std::string_view text, std::size_t begin, char line_end) {
  const std::size_t end = std::min(text.find(line_end, begin), text.size());
  std::string_view line = text.substr(begin, end - begin);
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
  return {line, std::min(end + 1, text.size())};
}

std::optional<NoHeader> read_csv_header(std::string_view text, CsvHeader& header) {
  return HeaderReader(text, header).read();
}

}  // namespace flexspline::data
