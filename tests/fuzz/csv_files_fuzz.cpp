// CSV files of any content, alone or with a dataset.toml next to them: what cannot be used is refused with a reason,
// and what is used is a data set that holds what host/input/data promises of one.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/csv.hpp"
#include "host/input/data/dataset.hpp"
#include "tests/fuzz/readers.hpp"

namespace {

using namespace flexspline;
using tests::require;

constexpr std::size_t kFewestOfSegment = 8;
const char* const kTolerable[] = {"not_finite",       "row_length", "velocity_position_mismatch",
                                  "wrapped_position", "jitter",     "conflict"};

void require_reasons(const data::DataError& error) {
  bool any = false;
  for (const data::Finding& f : error.findings()) {
    any |= f.severity == data::Severity::error;
    require(!f.what.empty() && !f.kind.empty(), "a finding says nothing");
  }
  require(any, "it refuses without an error");
}

// Every row of the text at most once, every number a place for itself.
void read_as_table(const std::filesystem::path& file, std::string_view text) {
  data::Findings findings;
  try {
    const data::CsvFile csv(file, findings);
    std::vector<std::size_t> all(csv.names().size());
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
    const data::Table table = csv.read(all);
    require(table.columns.size() == all.size(), "columns were lost");
    const std::size_t rows = table.lines.size();
    const auto ends = [&](char c) { return static_cast<std::size_t>(std::ranges::count(text, c)); };
    require(rows <= std::max(ends('\n'), ends('\r')) + 1, "there are more rows than lines");
    for (const auto& column : table.columns) require(column.size() == rows, "columns are of different length");
    require(std::ranges::is_sorted(table.lines, std::ranges::less_equal()) || rows < 2, "lines do not rise");
    for (std::size_t row = 1; row < rows; ++row)
      require(table.lines[row] > table.lines[row - 1], "two rows are of one line");
    for (const data::BadCell& cell : table.bad_cells) {
      require(cell.row < rows && cell.column < all.size(), "a bad cell is outside of the table");
      require(std::isnan(table.columns[cell.column][cell.row]), "a bad cell has a number");
    }
    for (const data::BadRow& bad : table.bad_rows) require(bad.row < rows, "a bad row is outside of the table");
    std::vector<std::uint8_t> is_bad(rows, 0);
    for (const data::BadRow& bad : table.bad_rows) is_bad[bad.row] = 1;
    for (const data::BadCell& cell : table.bad_cells) is_bad[cell.row] = 1;
    for (std::size_t row = 0; row < rows; ++row)
      for (const auto& column : table.columns)
        require(is_bad[row] || std::isfinite(column[row]), "what is no number passes for one");
  } catch (const data::DataError& error) {
    require_reasons(error);
  }
}

void require_whole(const data::Experiment& e) {
  const std::size_t n = e.size();
  require(n > 0 && std::isfinite(e.sample_s) && e.sample_s > 0.0, "an experiment without samples");
  require(e.masked.size() == n, "the mask is of another length");
  std::size_t behind = 0;
  require(!e.segments.empty(), "no segment");
  for (const data::Segment& s : e.segments) {
    require(s.first >= behind && s.last > s.first && s.last <= n, "segments overlap, or are outside");
    behind = s.last;
    for (std::size_t k = s.first; k < s.last; ++k) {
      require(std::isfinite(e.time_s[k]), "a time is no number");
      require(k == s.first || e.time_s[k] > e.time_s[k - 1], "time does not rise");
    }
    for (const auto& column : e.columns)
      if (!column.empty())
        for (std::size_t k = s.first; k < s.last; ++k) require(std::isfinite(column[k]), "a value is no number");
    require(s.last - s.first >= kFewestOfSegment, "a segment is too short to filter");
  }
  bool any = false;
  for (const auto& column : e.columns) {
    require(column.empty() || column.size() == n, "a column is of another length");
    any |= !column.empty();
  }
  require(any, "an experiment without a column");
}

}  // namespace

// The first byte: which kinds of findings are tolerated, and whether all is held out. What stands before a line "%%" is
// a dataset.toml, which may name the rest as data.csv.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  static const tests::ScratchFolder folder;
  data::LoadOptions options;
  for (std::size_t k = 0; k < std::size(kTolerable); ++k)
    if ((bytes[0] >> k & 1) != 0) options.tolerate.emplace_back(kTolerable[k]);
  options.holdout = (bytes[0] & 0x80) != 0;
  std::string_view text(reinterpret_cast<const char*>(bytes) + 1, size - 1);
  constexpr std::string_view kCut = "\n%%\n";
  const std::size_t cut = text.find(kCut);
  if (cut != std::string_view::npos) {
    folder.write("dataset.toml", text.substr(0, cut + 1));
    text.remove_prefix(cut + kCut.size());
  } else {
    std::filesystem::remove(folder.path() / "dataset.toml");
  }
  const std::filesystem::path file = folder.write("data.csv", text);
  read_as_table(file, text);
  try {
    const data::Dataset dataset = data::load({folder.path()}, options);
    require(!dataset.experiments.empty(), "a data set without an experiment");
    for (const data::Experiment& e : dataset.experiments) require_whole(e);
  } catch (const data::DataError& error) {
    require_reasons(error);
  }
  return 0;
}
