// An array of a format that counts from zero and stores by rows, as columns.
#pragma once

#include <string>
#include <vector>

#include "host/input/data/file_contents.hpp"

namespace flexspline::data {

// A vector keeps its name; of a matrix of samples by signals the columns are "name[0]", "name[1]" ... A single number
// is a key. What has too many signals or dimensions is refused.
void add_row_major_columns(FileContents& contents, const std::string& name, const std::vector<std::size_t>& dims,
                           const std::vector<double>& values);

}  // namespace flexspline::data
