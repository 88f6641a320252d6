// NumPy's files: .npy with one array, .npz with several.
#pragma once

#include <filesystem>

#include "host/input/data/file_contents.hpp"

namespace flexspline::data {

// Arrays go by their names in the file, of a .npy by "array"; columns of a matrix by "q[0]", fields of a structured
// array by "log.iq". What is damaged is a `failure`.
FileContents read_npz(const std::filesystem::path& path);
FileContents read_npy(const std::filesystem::path& path);

}  // namespace flexspline::data
