#include "host/input/data/csv_fields.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstring>

namespace flexspline::data {
namespace {

// "2024-05-01T12:30:15.250Z", a blank or nothing after the date, "12:30:15.25". A zone is left out: all stamps of a
// file have the same one.
std::optional<std::int64_t> time_stamp(std::string_view field) {
  const char* at = field.data();
  const char* const end = at + field.size();
  const auto number = [&](std::size_t digits, std::int64_t& value) {
    if (static_cast<std::size_t>(end - at) < digits) return false;
    const auto [stop, error] = std::from_chars(at, at + digits, value);
    if (error != std::errc{} || stop != at + digits) return false;
    at = stop;
    return true;
  };
  const auto sign = [&](char c) {
    if (at == end || *at != c) return false;
    ++at;
    return true;
  };
  std::int64_t day_ns = 0;
  if (field.size() > 10 && field[4] == '-' && field[7] == '-') {
    std::int64_t year = 0, month = 0, day = 0;
    if (!number(4, year) || !sign('-') || !number(2, month) || !sign('-') || !number(2, day)) return std::nullopt;
    const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                           std::chrono::month(static_cast<unsigned>(month)),
                                           std::chrono::day(static_cast<unsigned>(day))};
    // As nanoseconds there is room until 2262.
    if (year < 1900 || year > 2200) return std::nullopt;
    if (!date.ok() || (!sign('T') && !sign(' '))) return std::nullopt;
    day_ns = std::chrono::sys_days(date).time_since_epoch().count() * 86'400'000'000'000;
  }
  std::int64_t hour = 0, minute = 0, second = 0, fraction = 0;
  if (!number(2, hour) || !sign(':') || !number(2, minute) || !sign(':') || !number(2, second)) return std::nullopt;
  if (hour > 24 || minute > 59 || second > 60) return std::nullopt;
  if (at < end && (*at == '.' || *at == ',')) {
    std::int64_t place = 100'000'000;
    for (++at; at < end && *at >= '0' && *at <= '9'; ++at, place /= 10) fraction += place * (*at - '0');
  }
  if (at < end && *at != 'Z' && *at != '+' && *at != '-') return std::nullopt;
  return day_ns + ((hour * 60 + minute) * 60 + second) * 1'000'000'000 + fraction;
}

}  // namespace

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
  if (separator == ' ') line = trimmed(line);
  const char* at = line.data();
  const char* const end = at + line.size();
  while (true) {
    if (separator == ' ')
      while (at < end && is_blank(*at)) ++at;
    const char* stop = field_end(at, end, separator);
    fields.push_back(unquoted({at, static_cast<std::size_t>(stop - at)}));
    if (stop == end) return fields;
    at = stop + 1;
  }
}

char separator_of(std::string_view line) {
  constexpr std::string_view kSeparators = "\t;,";
  std::array<std::size_t, 3> count{};
  bool quoted = false;
  const auto is_digit = [&](std::size_t at) { return at < line.size() && line[at] >= '0' && line[at] <= '9'; };
  std::size_t decimal_marks = 0;  // commas that may be some
  for (std::size_t at = 0; at < line.size(); ++at) {
    if (line[at] == '"') quoted = !quoted;
    const std::size_t which = quoted ? std::string_view::npos : kSeparators.find(line[at]);
    if (which == std::string_view::npos) continue;
    ++count[which];
    if (line[at] == ',' && at > 0 && is_digit(at - 1) && is_digit(at + 1)) ++decimal_marks;
  }
  // A line of numbers with a decimal comma has one more of these than separators.
  if (count[0] + count[1] > 0 && count[2] == decimal_marks) count[2] = 0;
  const auto most = std::max_element(count.begin(), count.end());
  if (*most > 0) return kSeparators[static_cast<std::size_t>(most - count.begin())];
  return trimmed(line).find(' ') == std::string_view::npos ? ',' : ' ';
}

namespace {

// "0.25 sec", as MATLAB writes a duration: the number, and the seconds in its unit; 0: the field has none.
double take_duration(std::string_view& field) {
  static constexpr std::pair<std::string_view, double> kUnits[] = {{" sec", 1.0}, {" min", 60.0}, {" hr", 3600.0}};
  for (const auto& [unit, seconds] : kUnits)
    if (field.size() > unit.size() && field.ends_with(unit)) {
      field.remove_suffix(unit.size());
      return seconds;
    }
  return 0.0;
}

}  // namespace

Number number_from_field(std::string_view field, char separator) {
  field = unquoted(field);
  const double duration = take_duration(field);
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
    number.stamp_ns = time_stamp(field);
    number.decimal_comma = false;
    if (number.stamp_ns) return number;
    number.bad = BadCell::Kind::text;
    number.decimal_comma = false;
  } else if (error == std::errc::result_out_of_range && point.find("e-") != std::string::npos) {
    number.value = 0.0;  // too small for a double
  } else if (error != std::errc{} || !std::isfinite(value)) {
    number.bad = BadCell::Kind::not_finite;
  } else {
    number.value = duration > 0.0 ? duration * value : value;
  }
  return number;
}

bool is_number(std::string_view field, char separator) {
  const Number number = number_from_field(field, separator);
  return !number.bad || *number.bad == BadCell::Kind::not_finite;
}

}  // namespace flexspline::data
