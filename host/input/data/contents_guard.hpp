// Reads files with named arrays in a process of its own.
#pragma once

#include <filesystem>

#include "host/input/data/file_contents.hpp"
#include "host/input/data/file_format.hpp"

namespace flexspline::data {

// Neither matio nor HDF5 withstands every damaged file (of 3000 MAT files of version 7.3 with up to three bytes
// changed, 5 crashed or did not end): a crash, an endless loop or an absurd demand for memory becomes a `failure` here.
// MAT files of version 5 are checked by damage_of_mat5 first; one of version 7.3 that matio finds empty, as it does
// where another program than MATLAB wrote it, is read as the HDF5 file that it is.
FileContents read_contents(const std::filesystem::path& path, FileFormat format);

}  // namespace flexspline::data
