// Reads CSV files as loggers write them. Knows nothing of what the columns mean.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "host/input/data/csv_header.hpp"
#include "host/input/data/findings.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::data {

// A file in memory with its header understood. Separator: comma, semicolon or tab, whichever the header has most of, or
// blanks. Decimal point, or decimal comma where the separator is not one. CRLF, LF and CR, a UTF-8 byte order mark,
// gzip, quoted fields, a line of units and blank lines are understood; a header behind `#`, as NumPy writes it, is
// used where no other is given.
class CsvFile final : public Recording {
 public:
  // Throws DataError (with what `findings` holds) of kind "file", "format" or "header".
  CsvFile(const std::filesystem::path& path, Findings& findings);

  const std::vector<std::string>& names() const override { return header_.names; }
  const std::vector<HeaderKey>& keys() const override { return header_.keys; }
  std::size_t header_line() const override { return header_.line; }
  std::string unit(std::size_t name) const override;
  char separator() const { return header_.separator; }

  // Other columns may hold any text.
  Table read(std::span<const std::size_t> wanted) const override;

 private:
  std::string text_;
  CsvHeader header_;
};

}  // namespace flexspline::data
