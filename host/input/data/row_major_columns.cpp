#include "host/input/data/row_major_columns.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexspline::data {

void add_row_major_columns(FileContents& contents, const std::string& name, const std::vector<std::size_t>& dims,
                           const std::vector<double>& values) {
  constexpr std::size_t kMostColumns = 256;
  std::vector<std::size_t> real = dims;
  std::erase(real, std::size_t{1});
  if (values.empty()) {
    contents.refused.push_back({name, "is empty"});
  } else if (real.empty()) {
    contents.arrays.push_back({name, {1}, values});
  } else if (real.size() == 1) {
    contents.arrays.push_back({name, {real[0]}, values});
  } else if (real.size() > 2) {
    contents.refused.push_back({name, fmt::format("has {} dimensions", real.size())});
  } else {
    // Samples run along the longer side.
    const bool by_rows = real[0] >= real[1];
    const std::size_t samples = std::max(real[0], real[1]), signals = std::min(real[0], real[1]);
    if (signals > kMostColumns) {
      contents.refused.push_back(
          {name, fmt::format("is a matrix of {} by {}, too large to be signals", real[0], real[1])});
      return;
    }
    contents.refused.push_back({name, fmt::format("is a matrix, whose signals are \"{}[0]\" and so on", name)});
    for (std::size_t c = 0; c < signals; ++c) {
      NamedArray column{fmt::format("{}[{}]", name, c), {samples}, std::vector<double>(samples)};
      for (std::size_t r = 0; r < samples; ++r) column.values[r] = values[by_rows ? r * signals + c : c * samples + r];
      contents.arrays.push_back(std::move(column));
    }
  }
}

}  // namespace flexspline::data
