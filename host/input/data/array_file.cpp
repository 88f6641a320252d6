#include "host/input/data/array_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>

#include "host/input/data/contents_guard.hpp"

namespace flexspline::data {
namespace {

// A matrix with more signals than this is not a record of a drive; its names would hide all others.
constexpr std::size_t kMostSignals = 256;

void refuse_what_holds_no_arrays(const std::filesystem::path& path, FileFormat format, Findings& findings) {
  const std::string file = path.string();
  const std::ifstream stream(path, std::ios::binary);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || !stream) findings.fail("file", file, 0, "cannot read this file", "check the path and the permissions");
  if (size == 0) findings.fail("header", file, 0, "the file is empty", "record again, or leave the file out");
  if (format == FileFormat::mat4)
    findings.fail("format", file, 0, "this is a MAT file of version 4, which is not read",
                  "load it in MATLAB and save it by save(\"run.mat\", \"-v7\")");
  if (format == FileFormat::text)
    findings.fail("format", file, 0, "this is not a MAT file: MATLAB's header is missing or cut off",
                  "copy or save it again, in MATLAB by save(\"run.mat\", \"-v7\"); a CSV file must not end in .mat");
}

bool is_of_matlab(FileFormat format) {
  return format == FileFormat::mat5 || format == FileFormat::mat7_3;
}

}  // namespace

ArrayFile::ArrayFile(const std::filesystem::path& path, FileFormat format, Findings& findings) {
  refuse_what_holds_no_arrays(path, format, findings);
  contents_ = read_contents(path, format);
  if (!contents_.failure.empty())
    findings.fail("format", path.string(), 0, "the file " + contents_.failure,
                  is_of_matlab(format) ? "copy it again from where it was recorded, or save it again in MATLAB"
                                       : "copy it again from where it was recorded");
  for (const std::string& loss : contents_.losses)
    findings.add(Severity::warning, "left_out", path.string(), 0, "", loss,
                 "record again, or save the signals that matter in a file of their own");
  name_by_labels();
  for (const NotAColumn& refused : contents_.refused) why_not_.emplace(refused.name, refused.why);
  for (const NamedText& text : contents_.texts) take_key(text.name, text.text, "is text");
  for (std::size_t i = 0; i < contents_.arrays.size(); ++i) take(i);
  if (!names_.empty()) return;
  std::string there;
  for (const auto& [name, why] : why_not_) there += fmt::format("{}\"{}\" {}", there.empty() ? ": " : ", ", name, why);
  findings.fail("header", path.string(), 0, "the file holds no vector or matrix of real numbers" + there,
                is_of_matlab(format) ? "save each signal as a vector: save(\"run.mat\", \"time_s\", \"current_a\", ...)"
                                     : "save each signal as a vector of numbers");
}

// Recorders such as ControlDesk's put each signal into an element of a struct array, "run.Y(3)", with its values in
// Data, with name and unit as separate texts, and the time into "run.X".
void ArrayFile::name_by_labels() {
  std::map<std::string, std::string> texts;
  for (const NamedText& text : contents_.texts) texts.emplace(text.name, text.text);
  std::set<std::string> taken;
  for (NamedArray& array : contents_.arrays) {
    if (!array.name.ends_with(".Data")) continue;
    const std::string element = array.name.substr(0, array.name.size() - 5);
    const auto text = [&](const char* field) {
      const auto at = texts.find(element + field);
      return at == texts.end() ? std::string() : at->second;
    };
    std::string label = text(".Name");
    // A path in a model: its last part is the signal's name.
    label = label.substr(label.find_last_of('/') + 1);
    std::erase(label, '"');
    if (label.empty() && element.ends_with(".X")) label = "time";
    if (label.empty()) continue;
    std::string name = label;
    for (int number = 2; !taken.insert(name).second; ++number) name = fmt::format("{} {}", label, number);
    array.name = name;
    if (const std::string unit = text(".Unit"); !unit.empty()) units_[name] = unit;
  }
}

std::string ArrayFile::unit(std::size_t name) const {
  const auto at = units_.find(names_[name]);
  return at == units_.end() ? std::string() : at->second;
}

void ArrayFile::add(std::string name, const View& view) {
  names_.push_back(std::move(name));
  views_.push_back(view);
}

// In MATLAB any number is an array: dimensions of one do not count.
void ArrayFile::take(std::size_t array) {
  const NamedArray& a = contents_.arrays[array];
  std::vector<std::size_t> dims = a.dims;
  std::erase(dims, std::size_t{1});
  if (dims.empty())
    take_key(a.name, fmt::format("{}", a.values.front()), "is a single number");
  else if (dims.size() == 1)
    add(a.name, {array, 0, 1, dims[0]});
  else if (dims.size() == 2)
    take_matrix(array, dims[0], dims[1]);
  else
    why_not_.emplace(a.name, fmt::format("has {} dimensions", dims.size()));
}

void ArrayFile::take_matrix(std::size_t array, std::size_t rows, std::size_t columns) {
  const std::string& name = contents_.arrays[array].name;
  const bool in_columns = rows >= columns;
  if (std::min(rows, columns) > kMostSignals) {
    why_not_.emplace(name, fmt::format("is a matrix of {} by {}, too large to be signals", rows, columns));
    return;
  }
  why_not_.emplace(name, fmt::format("is a matrix of {} by {}, whose signals are \"{}({})\" and so on", rows, columns,
                                     name, in_columns ? ":,1" : "1,:"));
  if (in_columns)
    for (std::size_t k = 0; k < columns; ++k) add(fmt::format("{}(:,{})", name, k + 1), {array, k * rows, 1, rows});
  else
    for (std::size_t k = 0; k < rows; ++k) add(fmt::format("{}({},:)", name, k + 1), {array, k, rows, columns});
}

void ArrayFile::take_key(const std::string& name, const std::string& value, const char* what) {
  keys_.push_back({name, value, 0});
  why_not_.emplace(name, what);
}

std::string ArrayFile::why_not(std::string_view name) const {
  const auto at = why_not_.find(name);
  return at == why_not_.end() ? std::string() : at->second;
}

Table ArrayFile::read(std::span<const std::size_t> wanted) const {
  Table table;
  for (std::size_t column_index = 0; column_index < wanted.size(); ++column_index) {
    const View& view = views_[wanted[column_index]];
    const std::vector<double>& values = contents_.arrays[view.array].values;
    std::vector<double>& column = table.columns.emplace_back(view.count);
    for (std::size_t row = 0; row < view.count; ++row) {
      const double value = values[view.first + row * view.step];
      column[row] = value;
      if (std::isfinite(value)) continue;
      column[row] = std::numeric_limits<double>::quiet_NaN();
      const char* text = std::isnan(value) ? "NaN" : value > 0.0 ? "Inf" : "-Inf";
      table.bad_cells.push_back({row, column_index, BadCell::Kind::not_finite, text});
    }
  }
  std::stable_sort(table.bad_cells.begin(), table.bad_cells.end(),
                   [](const BadCell& a, const BadCell& b) { return a.row < b.row; });
  return table;
}

}  // namespace flexspline::data
