#include "host/data/recording.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/data/csv.hpp"
#include "host/data/mat.hpp"
#include "host/data/mat5_check.hpp"

namespace flexspline::data {
namespace {

namespace fs = std::filesystem;

bool is_recording(const fs::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".csv" || extension == ".tsv" || extension == ".mat";
}

}  // namespace

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c); });
  return extension;
}

std::string Table::place(std::size_t row) const {
  return lines.empty() ? fmt::format("sample {}: ", row + 1) : "";
}

std::unique_ptr<Recording> open_recording(const fs::path& path, Findings& findings) {
  const MatVersion version = mat_version(path);
  if (lower_extension(path) == ".mat" || version == MatVersion::v5 || version == MatVersion::v7_3)
    return std::make_unique<MatFile>(path, findings);
  return std::make_unique<CsvFile>(path, findings);
}

std::vector<fs::path> recordings_in(const fs::path& folder, Findings& findings) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && is_recording(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty())
    findings.fail("file", folder.string(), 0, "the folder has no CSV or MAT file and no dataset.toml",
                  "give a folder with .csv, .tsv or .mat files");
  return files;
}

}  // namespace flexspline::data
