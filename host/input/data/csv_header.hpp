// What is above the numbers of a CSV file: keys, names, units, and lines of a logger's own.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/recording.hpp"

namespace flexspline::data {

struct CsvHeader {
  char line_end = '\n';
  char separator = ',';
  std::vector<std::string> names;
  std::vector<std::string> units;  // as names; empty where no line of units is under them
  std::vector<HeaderKey> keys;
  std::size_t line = 0;        // of the names
  std::size_t units_line = 0;  // 0: none
  std::size_t skipped = 0;     // lines before the names that are no comments
  bool latin1 = false;         // the names were not UTF-8
  std::size_t data_begin = 0;  // offset of the first line of numbers
  std::size_t data_line = 0;
};

struct CsvLine {
  std::string_view text;  // without blanks around it; a tab at its beginning stays: an empty first field
  std::size_t next = 0;   // offset of the line behind it
};
CsvLine csv_line_at(std::string_view text, std::size_t begin, char line_end);

// Why there is no header, as the end of a sentence; `header` is filled otherwise.
struct NoHeader {
  std::size_t line = 0;
  std::string what;
};
std::optional<NoHeader> read_csv_header(std::string_view text, CsvHeader& header);

}  // namespace flexspline::data
