// The fields of a line of CSV text, and what number one is.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/recording.hpp"

namespace flexspline::data {

inline bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}
std::string_view trimmed(std::string_view text);
// Without the quotes around it.
std::string_view unquoted(std::string_view field);

// Tab, semicolon or comma, whichever occurs most often outside quotes; else a blank where blanks part words.
char separator_of(std::string_view line);
// First separator outside quotes at or after `at`, or the end of the line.
const char* field_end(const char* at, const char* end, char separator);
// Where the separator is a blank, several count as one.
std::vector<std::string_view> split(std::string_view line, char separator);

struct Number {
  double value = std::numeric_limits<double>::quiet_NaN();
  std::optional<BadCell::Kind> bad;
  bool decimal_comma = false;
  std::optional<std::int64_t> stamp_ns;  // of a date and time (ISO 8601), or of a time of day; `value` is open then
};
// A whole field, the slow and tolerant way: blanks, quotes, a plus sign, a decimal comma, words for missing values,
// time stamps.
Number number_from_field(std::string_view field, char separator);
bool is_number(std::string_view field, char separator);

}  // namespace flexspline::data
