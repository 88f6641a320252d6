// A text file in memory: plain or compressed by gzip, refused early where it is no text.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "host/input/data/findings.hpp"

namespace flexspline::data {

// Throws DataError (with what `findings` holds) of kind "file", "header" or "format". A binary file is refused by its
// first bytes, a sparse one by its first long run of zeros, whatever its size.
std::string read_text(const std::filesystem::path& path, Findings& findings);

// Whether a file begins as gzip writes it.
bool is_gzip(const std::filesystem::path& path);

bool is_utf8(std::string_view text);
// Text of code page 1252, of which Latin-1 is the part that names and units use, as UTF-8.
std::string utf8_from_latin1(std::string_view text);

}  // namespace flexspline::data
