// MAT files as named arrays: structs are flattened to names such as "log.motor.iq".
#pragma once

#include <filesystem>

#include "host/input/data/file_contents.hpp"

namespace flexspline::data {

// Reads a file of version 5 or 7.3 with matio in this process. Damaged files may crash it.
FileContents read_mat_unguarded(const std::filesystem::path& path);

}  // namespace flexspline::data
