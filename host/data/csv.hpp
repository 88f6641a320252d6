// Reads CSV files as loggers write them. Knows nothing of what the columns mean.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/data/findings.hpp"

namespace flexspline::data {

struct HeaderKey {  // "# key: value"
  std::string key;
  std::string value;
  std::size_t line = 0;
};

// A cell of a wanted column that is no finite number; its value in the table is NaN.
struct BadCell {
  enum class Kind : std::uint8_t { text, not_finite, empty };
  std::size_t row = 0;
  std::size_t column = 0;  // index into `wanted`
  Kind kind = Kind::text;
  std::string text;
};

// A row with more or fewer fields than the header; its values are NaN.
struct BadRow {
  std::size_t row = 0;
  std::size_t fields = 0;
};

struct CsvTable {
  std::vector<std::vector<double>> columns;  // as `wanted`, one value per row
  std::vector<std::uint32_t> lines;          // line in the file of each row
  std::vector<BadCell> bad_cells;            // in the order of rows
  std::vector<BadRow> bad_rows;
  std::size_t mixed_decimals_line = 0;  // first decimal comma in a file that has decimal points as well; 0: none

  std::size_t rows() const { return lines.size(); }
};

// A file in memory with its header understood. Separator: comma, semicolon or tab, whichever the header has most of.
// Decimal point, or decimal comma where the separator is not one. CRLF, LF and CR, a UTF-8 byte order mark, quoted
// fields and blank lines are understood; a header behind `#`, as NumPy writes it, is taken where no other stands.
class CsvFile {
 public:
  // Throws DataError (with what `findings` holds) of kind "file", "format" or "header".
  CsvFile(const std::filesystem::path& path, Findings& findings);

  const std::vector<std::string>& names() const { return names_; }
  const std::vector<HeaderKey>& keys() const { return keys_; }
  std::size_t header_line() const { return header_line_; }
  char separator() const { return separator_; }

  // Parses the columns with these indices into names(), each at most once. Other columns may hold any text.
  CsvTable read(std::span<const std::size_t> wanted) const;

 private:
  void read_header(const std::string& file, Findings& findings);

  std::string text_;
  char line_end_ = '\n';
  char separator_ = ',';
  std::size_t data_begin_ = 0;  // offset of the first line after the header
  std::size_t header_line_ = 0;
  std::size_t data_line_ = 0;
  std::vector<std::string> names_;
  std::vector<HeaderKey> keys_;
};

}  // namespace flexspline::data
