// A file with columns of numbers under the names that a logger gave them: CSV text, MAT, HDF5, NumPy.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/findings.hpp"

namespace flexspline::data {

// ".csv" of "A.CSV"; the same in any locale.
std::string lower_extension(const std::filesystem::path& path);

struct HeaderKey {  // "# key: value" of a CSV file, or a variable of that name in a MAT file
  std::string key;
  std::string value;
  std::size_t line = 0;  // 0: the file has no lines
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

struct Table {
  std::vector<std::vector<double>> columns;  // as `wanted`, one value per row
  std::vector<std::uint32_t> lines;          // line in the file of each row; empty where the file has no lines
  std::vector<BadCell> bad_cells;            // in the order of rows
  std::vector<BadRow> bad_rows;
  bool time_stamps = false;  // some fields are dates or times of day; their values are seconds since the first
  std::size_t mixed_decimals_line = 0;  // first decimal comma in a file that has decimal points as well; 0: none

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().size(); }
  // Line of a row for Finding::line; 0 where the file has no lines.
  std::size_t line(std::size_t row) const { return lines.empty() ? 0 : lines[row]; }
  // "sample 17: " where the file has no lines to count by, else nothing; samples count from one as in MATLAB.
  std::string place(std::size_t row) const;
};

class Recording {
 public:
  Recording() = default;
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  virtual ~Recording() = default;

  virtual const std::vector<std::string>& names() const = 0;
  virtual const std::vector<HeaderKey>& keys() const = 0;
  virtual std::size_t header_line() const { return 0; }

  // The unit that the file states next to a name; empty where it does not.
  virtual std::string unit(std::size_t) const { return {}; }

  // Number of values under a name; columns of one length make one table. A CSV file is one table throughout, and says
  // 0.
  virtual std::size_t length(std::size_t) const { return 0; }
  // Why there is no column of this name though something in the file is called so: "is complex"; empty if nothing is.
  virtual std::string why_not(std::string_view) const { return {}; }

  // The columns with these indices into names(), each at most once. All must be of one length.
  virtual Table read(std::span<const std::size_t> wanted) const = 0;
};

// "log.iq" as the names have it for element 2 of a struct array: "log(2).iq"; the name itself where there is none.
std::string name_of_element(const std::vector<std::string>& names, std::string_view name, std::size_t element);
// The other way round: "log.iq" and 2 of "log(2).iq"; the name itself and 0 where it is of no struct array.
struct ElementName {
  std::string name;
  std::size_t element = 0;
};
ElementName without_element(std::string_view name);

// Opens a file by its first bytes as what it is; what is of no known format as CSV. Throws DataError (with what
// `findings` holds) of kind "file", "format" or "header".
std::unique_ptr<Recording> open_recording(const std::filesystem::path& path, Findings& findings);

// Whether a file is read as a recording where a folder is given: by its ending; a .txt where it begins with a table.
bool is_recording(const std::filesystem::path& path);

// The recordings right in a folder, by name. Throws DataError of kind "file" if there
// are none.
std::vector<std::filesystem::path> recordings_in(const std::filesystem::path& folder, Findings& findings);

}  // namespace flexspline::data
