// Reads CSV files as loggers write them. Knows nothing of what the columns mean.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "host/data/findings.hpp"
#include "host/data/recording.hpp"

namespace flexspline::data {

// A file in memory with its header understood. Separator: comma, semicolon or tab, whichever the header has most of.
// Decimal point, or decimal comma where the separator is not one. CRLF, LF and CR, a UTF-8 byte order mark, quoted
// fields and blank lines are understood; a header behind `#`, as NumPy writes it, is taken where no other stands.
class CsvFile final : public Recording {
 public:
  // Throws DataError (with what `findings` holds) of kind "file", "format" or "header".
  CsvFile(const std::filesystem::path& path, Findings& findings);

  const std::vector<std::string>& names() const override { return names_; }
  const std::vector<HeaderKey>& keys() const override { return keys_; }
  std::size_t header_line() const override { return header_line_; }
  char separator() const { return separator_; }

  // Other columns may hold any text.
  Table read(std::span<const std::size_t> wanted) const override;

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
