// MAT files as matio writes them, for the tests of host/input/data.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace flexspline::data {

enum class MatFormat { v5, v5_packed, v7_3, v7_3_packed };

struct MatVariable {
  std::string name;  // "log.iq" is the field iq of the struct log; fields of one struct stand one after another
  std::vector<std::size_t> dims;
  std::vector<double> values;  // column-major
};

inline MatVariable mat_vector(std::string name, std::vector<double> values) {
  return {std::move(name), {values.size(), 1}, std::move(values)};
}

// Throws std::runtime_error if matio does not write it.
void write_mat(const std::filesystem::path& path, MatFormat format, const std::vector<MatVariable>& variables);

}  // namespace flexspline::data
