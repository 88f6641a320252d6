#pragma once

#include <filesystem>
#include <string_view>

namespace flexspline::plant {

/// Writes a file that, under its final name, is always complete: it is written to another name and renamed. Throws
/// std::runtime_error where it cannot be written.
void write_whole(const std::filesystem::path& file, std::string_view text);

/// Makes a folder and those above it. Throws std::runtime_error where it cannot.
void make_folder(const std::filesystem::path& folder);

}  // namespace flexspline::plant
