// Whether a MAT file is one, is whole, and its sizes agree with each other, before matio reads it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace flexspline::data {

enum class MatVersion : std::uint8_t { none, v4, v5, v7_3 };

// By the first bytes. `v4` has no mark of its own and is only recognised in files that end in .mat.
MatVersion mat_version(const std::filesystem::path& path);

// Walks all elements of a version 5 file in memory, inflates those that are compressed and compares their checksums:
// matio reads on where data are cut short or damaged, and what it then returns looks like numbers (of 1500 compressed
// files with up to three bytes changed it read 1400 without a word). Returns what is wrong as the end of a sentence
// that begins with the file, or nothing.
std::string damage_of_mat5(std::string_view file);

}  // namespace flexspline::data
