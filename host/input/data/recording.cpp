#include "host/input/data/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>

#include "host/input/data/array_file.hpp"
#include "host/input/data/csv.hpp"
#include "host/input/data/csv_fields.hpp"
#include "host/input/data/file_format.hpp"

namespace flexspline::data {
namespace {

namespace fs = std::filesystem;

// Whether a text is a table, as notes are none: so many lines of two numbers at least, as the fewest samples need.
bool is_table(const fs::path& path) {
  constexpr int kFewestLines = 32;
  constexpr std::size_t kMostBytes = 1 << 18;
  std::ifstream file(path, std::ios::binary);
  std::size_t bytes = 0;
  int lines = 0;
  for (std::string line; lines < kFewestLines && bytes < kMostBytes && std::getline(file, line);) {
    bytes += line.size() + 1;
    const char separator = separator_of(line);
    const std::vector<std::string_view> fields = split(line, separator);
    lines += fields.size() >= 2 && is_number(fields[0], separator) && is_number(fields[1], separator);
  }
  return lines == kFewestLines;
}

}  // namespace

bool is_recording(const fs::path& path) {
  static constexpr std::string_view kEndings[] = {".csv", ".tsv", ".mat", ".h5",  ".hdf5",
                                                  ".npz", ".npy", ".bag", ".db3", ".mcap"};
  std::string extension = lower_extension(path);
  if (extension == ".gz") extension = lower_extension(path.stem());
  if (extension == ".txt") return is_table(path);
  return std::find(std::begin(kEndings), std::end(kEndings), extension) != std::end(kEndings);
}

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c); });
  return extension;
}

std::string Table::place(std::size_t row) const {
  return lines.empty() ? fmt::format("sample {}: ", row + 1) : "";
}

std::string name_of_element(const std::vector<std::string>& names, std::string_view name, std::size_t element) {
  for (std::size_t dot = name.find('.'); dot != std::string_view::npos; dot = name.find('.', dot + 1)) {
    const std::string of_element = fmt::format("{}({}){}", name.substr(0, dot), element, name.substr(dot));
    if (std::find(names.begin(), names.end(), of_element) != names.end()) return of_element;
  }
  return std::string(name);
}

ElementName without_element(std::string_view name) {
  const std::size_t open = name.find('('), close = name.find(").");
  if (open == std::string_view::npos || close == std::string_view::npos || close <= open + 1)
    return {std::string(name), 0};
  std::size_t element = 0;
  const char* const end = name.data() + close;
  const auto [stop, error] = std::from_chars(name.data() + open + 1, end, element);
  if (error != std::errc{} || stop != end) return {std::string(name), 0};
  return {fmt::format("{}{}", name.substr(0, open), name.substr(close + 1)), element};
}

std::unique_ptr<Recording> open_recording(const fs::path& path, Findings& findings) {
  const FileFormat format = format_of(path);
  if (format == FileFormat::foreign) {
    const FormatAdvice way = way_out(path);
    findings.fail("format", path.string(), 0, way.what, way.remedy);
  }
  if (format == FileFormat::text && lower_extension(path) != ".mat") return std::make_unique<CsvFile>(path, findings);
  return std::make_unique<ArrayFile>(path, format, findings);
}

std::vector<fs::path> recordings_in(const fs::path& folder, Findings& findings) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && is_recording(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty())
    findings.fail(
        "file", folder.string(), 0, "the folder has no CSV or MAT file and no dataset.toml",
        "give a folder with .csv, .tsv, .mat, .h5, .npz, .npy, .bag, .db3 or .mcap files, or tables in .txt files");
  return files;
}

}  // namespace flexspline::data
