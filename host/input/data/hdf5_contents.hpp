// HDF5 files (and MAT files of version 7.3, which are some) as named arrays.
#pragma once

#include <filesystem>

#include "host/input/data/file_contents.hpp"

namespace flexspline::data {

// Data sets of numbers go by their path, "log/motor/iq"; of one with several columns "log/q[0]", "log/q[1]"; of one
// whose entries have fields "table/iq". `matlab`: names and dimensions as MATLAB has them, "log.motor.iq". Damaged
// files may crash it.
FileContents read_hdf5_unguarded(const std::filesystem::path& path, bool matlab);

}  // namespace flexspline::data
